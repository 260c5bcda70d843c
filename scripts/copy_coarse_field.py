"""Rule copy_coarse_field: round 0 is the coarse field."""

from dav_gswt.files import copy_file
from dav_gswt.logs import logging_to

with logging_to(snakemake.log[0]):
    for source, target in zip(snakemake.input, snakemake.output, strict=True):
        copy_file(source, target)
