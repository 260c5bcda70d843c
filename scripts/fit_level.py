"""Rule fit_level: a coarser level, fitted to its finer neighbour's pictures."""

import numpy as np

from dav_gswt import field
from dav_gswt.coarse import ground
from dav_gswt.levels import build as levels
from dav_gswt.logs import logging_to

with logging_to(snakemake.log[0]):
    given, params = snakemake.input, snakemake.params
    level, grid = levels.coarser(
        field.read(given.field),
        ground.read(given.ground),
        params.quality["level_steps"],
        np.random.default_rng([params.seed, params.level]),
        params.keep,
    )
    field.write(level, snakemake.output.field)
    ground.write(grid, snakemake.output.ground)
