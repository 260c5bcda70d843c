"""Rule import_field: a finished 3DGS field in the ground frame."""

from dav_gswt.logs import logging_to
from dav_gswt.photos.photo_set import import_field

with logging_to(snakemake.log[0]):
    import_field(
        snakemake.input[0],
        snakemake.output.field,
        snakemake.output.frame,
        up=snakemake.params.scene.get("up"),
        crop=snakemake.params.scene.get("crop"),
    )
