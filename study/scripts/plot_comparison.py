"""Rule plot_comparison: measures of a sweep over the setting that it varies."""

from dav_gswt.logs import logging_to
from dav_gswt_study.sweeps import plots, tables

with logging_to(snakemake.log[0]):
    rows, params = tables.read_sweep(snakemake.input.table), snakemake.params
    plots.write_figure(snakemake.output.plot, snakemake.wildcards.sweep, params.axes, rows)
