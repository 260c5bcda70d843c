"""Rule capture_views: the photos of this round."""

from pathlib import Path

from dav_gswt.capture.capturing import capture_views
from dav_gswt.capture.store import PhotoStore, Site
from dav_gswt.geometry.scene_frame import read_scene_frame
from dav_gswt.logs import logging_to
from dav_gswt.photos.view_split import read_view_split
from dav_gswt.views.selection import read_pose_selection

with logging_to(snakemake.log[0]):
    paths, name = snakemake.input, snakemake.wildcards.scene
    store = PhotoStore(Path("captures").resolve() / name)
    photos = Path(paths.images).parent
    frame, files = read_scene_frame(paths.frame), (paths.get("field"), paths.get("template", ""))
    site = Site(name, snakemake.params.scene, frame, photos, store, *files)
    before = list(paths.captures)
    chosen = read_pose_selection(paths.poses).poses
    capture_views(site, read_view_split(paths.views), before, chosen, Path(snakemake.output.capture))
