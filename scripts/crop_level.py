"""Rule crop_level: the finest level."""

from dav_gswt import field
from dav_gswt.coarse import ground
from dav_gswt.levels import merge
from dav_gswt.logs import logging_to

with logging_to(snakemake.log[0]):
    given = field.read(snakemake.input.field), ground.read(snakemake.input.ground)
    level, grid = merge.cropped(*given, block=2 ** (snakemake.params.levels - 1))
    field.write(level, snakemake.output.field)
    ground.write(grid, snakemake.output.ground)
