"""Rule capture_views: the photos of this round."""

from pathlib import Path

from dav_gswt.capture.agents import capture_views
from dav_gswt.capture.site import Site
from dav_gswt.capture.store import PhotoStore
from dav_gswt.geometry.scene_frame import read_scene_frame
from dav_gswt.logs import logging_to
from dav_gswt.photos.view_split import read_view_split
from dav_gswt.views.selection import read_pose_selection

with logging_to(snakemake.log[0]):
    given, name = snakemake.input, snakemake.wildcards.scene
    store = PhotoStore(Path("captures") / name)
    photos = Path(given.images).parent
    site = Site(name, snakemake.params.scene, read_scene_frame(given.frame), photos, store, given.get("field"))
    before = list(given.captures)
    chosen = read_pose_selection(given.poses).poses
    capture_views(site, read_view_split(given.views), before, chosen, Path(snakemake.output.capture))
