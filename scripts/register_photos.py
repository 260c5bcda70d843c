"""Rule register_photos: a folder of photos as undistorted pictures with cameras over a ground frame."""

from pathlib import Path

from dav_gswt.logs import logging_to
from dav_gswt.photos import photo_set
from dav_gswt.photos.sfm import registration

with logging_to(snakemake.log[0]):
    scene = snakemake.params.scene
    options = registration.options_of(scene, snakemake.threads)
    out = Path(snakemake.output.frame).parent
    photo_set.from_photos(scene["folder"], out, options, scene.get("model"), scene.get("masks"))
