"""Rule plot_sweep: what a sweep measured, over what it varied."""

from dav_gswt.logs import logging_to
from dav_gswt.study.sweeps import plots, tables

with logging_to(snakemake.log[0]):
    rows, params = tables.read(snakemake.input.table), snakemake.params
    plots.write(snakemake.output.plot, snakemake.wildcards.sweep, params.axes, rows)
