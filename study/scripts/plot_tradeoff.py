"""Rule plot_tradeoff: quality of settings over their time."""

from dav_gswt.images import figures
from dav_gswt.logs import logging_to
from dav_gswt_study.tradeoff import plots, tables

with logging_to(snakemake.log[0]):
    paths, out = snakemake.input, snakemake.output
    figures.save_figure(plots.draw_fronts(tables.read_tradeoff(paths.pareto)), out.pareto)
    figures.save_figure(plots.draw_knobs(tables.read_tradeoff(paths.table)), out.knobs)
