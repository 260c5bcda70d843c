"""Rule register_photos: a folder of photos as undistorted pictures with cameras over a ground frame."""

from pathlib import Path

from dav_gswt.logs import logging_to
from dav_gswt.photos.photo_set import prepare_photos
from dav_gswt.photos.sfm.registration import choose_sfm_options

with logging_to(snakemake.log[0]):
    scene = snakemake.params.scene
    options = choose_sfm_options(scene, snakemake.threads)
    out = Path(snakemake.output.frame).parent
    prepare_photos(scene["folder"], out, options, scene.get("model"), scene.get("masks"))
