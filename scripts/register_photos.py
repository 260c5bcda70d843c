"""Rule register_photos: a folder of photos as undistorted pictures with cameras over a ground frame."""

from pathlib import Path

from dav_gswt.files import locate_path
from dav_gswt.logs import logging_to
from dav_gswt.photos.photo_listing import locate_source
from dav_gswt.photos.photo_set import prepare_photos
from dav_gswt.photos.sfm.registration import SfmOptions

with logging_to(snakemake.log[0]):
    scene = snakemake.params.scene
    options = SfmOptions(scene["size"], scene.get("focal"), threads=snakemake.threads)
    model, masks = (locate_path(scene[key]) if key in scene else None for key in ("model", "masks"))
    folder = snakemake.input.get("frames") or locate_source(scene["folder"])  # the frames of a video
    prepare_photos(folder, Path(snakemake.output.frame).parent, options, model, masks)
