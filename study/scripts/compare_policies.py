"""Rule compare_policies: the rounds of all cells, and from these curves tables, a figure and the page."""

from dav_gswt.logs import logging_to
from dav_gswt_study import csv_tables
from dav_gswt_study.comparison import curves, page, tables
from dav_gswt_study.markdown import write_page

with logging_to(snakemake.log[0]):
    out, params = snakemake.output, snakemake.params
    csv_tables.write_table(out.curves, [row for cell in params.cells for row in curves.read_cell(cell)])
    rounds = curves.read_curves(out.curves)
    results = tables.summarise_cells(rounds)
    compared = tables.compare_to_baseline(results, params.baseline)
    csv_tables.write_table(out.results, results)
    csv_tables.write_table(out.compared, compared)
    page.write_figure(out.plot, rounds, compared, params.baseline)
    grouped = tables.compare_groups(results, params.baseline, params.groups)
    values = page.describe_comparison(rounds, results, compared, grouped, params.baseline)
    write_page(out.page, snakemake.input.template, values | {"table": snakemake.wildcards.table})
