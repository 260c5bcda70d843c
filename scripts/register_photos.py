"""Rule register_photos: a folder of photos as undistorted pictures with cameras over a ground frame."""

from pathlib import Path

from dav_gswt.logs import logging_to
from dav_gswt.photos import build, sfm

with logging_to(snakemake.log[0]):
    scene = snakemake.params.scene
    options = sfm.options_of(scene, snakemake.threads)
    out = Path(snakemake.output.frame).parent
    build.from_photos(scene["folder"], out, options, scene.get("model"), scene.get("masks"))
