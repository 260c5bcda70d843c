"""Rule crop_level: the finest level."""

from dav_gswt import field
from dav_gswt.active import maps
from dav_gswt.coarse import ground
from dav_gswt.levels import merge
from dav_gswt.logs import logging_to

with logging_to(snakemake.log[0]):
    given = snakemake.input
    fitted, grid = field.read(given.field), ground.read(given.ground)
    if given.get("maps"):  # a prior was asked: what it doubts is what the tiles go by
        fitted = maps.doubted(fitted, maps.read(given.maps)[1])
    level, grid = merge.cropped(fitted, grid, block=2 ** (snakemake.params.levels - 1))
    field.write(level, snakemake.output.field)
    ground.write(grid, snakemake.output.ground)
