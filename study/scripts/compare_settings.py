"""Rule compare_settings: all settings as one table, the Pareto front of those measured by test views, and the page."""

from dav_gswt.images import figures
from dav_gswt.logs import logging_to
from dav_gswt_study import csv_tables
from dav_gswt_study.markdown import write_page
from dav_gswt_study.tradeoff import page, plots, tables

with logging_to(snakemake.log[0]):
    out = snakemake.output
    measured = tables.tabulate_settings(snakemake.params.cells)
    csv_tables.write_table(out.table, measured)
    csv_tables.write_table(out.pareto, tables.tabulate_front(measured))
    csv_tables.update_table(out.kept, measured, tables.KEY)
    rows, front = tables.read_tradeoff(out.table), tables.read_tradeoff(out.pareto)
    figures.save_figure(plots.draw_fronts(front), out.fronts)
    figures.save_figure(plots.draw_knobs(rows), out.knobs)
    write_page(out.page, snakemake.input.template, page.describe_tradeoff(rows, front))
