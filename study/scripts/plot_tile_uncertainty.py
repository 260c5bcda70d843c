"""Rule plot_tile_uncertainty: the tiles of the terrain by their uncertainty, and a walk over them."""

from dav_gswt.files import read_json
from dav_gswt.logs import logging_to
from dav_gswt_study.terrain import tile_uncertainty

with logging_to(snakemake.log[0]):
    params = snakemake.params
    tile_uncertainty.write_figure(snakemake.output.plot, read_json(snakemake.input.manifest), params.tau, params.length)
