"""Rule convert_plys: patches of terrain in other programs' formats."""

from dav_gswt.export import splats
from dav_gswt.logs import logging_to

with logging_to(snakemake.log[0]):
    version = snakemake.params.spz_version
    splats.convert_plys(snakemake.input.plys, snakemake.wildcards.kind, snakemake.output.splats, version)
