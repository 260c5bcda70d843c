"""Rule plot_tradeoff: quality of settings over their time."""

from dav_gswt.logs import logging_to
from dav_gswt.study import figures
from dav_gswt.study.tradeoff import plots, tables

with logging_to(snakemake.log[0]):
    given, out = snakemake.input, snakemake.output
    figures.save(plots.fronts(tables.read(given.pareto)), out.pareto)
    figures.save(plots.knobs(tables.read(given.table)), out.knobs)
