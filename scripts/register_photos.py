"""Rule register_photos: a folder of photos as undistorted pictures with cameras over a ground frame."""

from pathlib import Path

from dav_gswt.logs import logging_to
from dav_gswt.photos import build, sfm

with logging_to(snakemake.log[0]):
    scene = snakemake.params.scene
    options = sfm.Options(size=min(1024, scene["size"]), side=scene["size"], threads=snakemake.threads)
    build.from_photos(scene["folder"], Path(snakemake.output.frame).parent, options)
