"""Rule compare_policies: from curves to tables and a figure."""

from dav_gswt.logs import logging_to
from dav_gswt.study import csv_tables
from dav_gswt.study.comparison import curves, markdown, plots, tables

with logging_to(snakemake.log[0]):
    out, baseline = snakemake.output, snakemake.params.baseline
    rounds = curves.read_curves(snakemake.input.curves)
    results = tables.summarise_cells(rounds)
    compared = tables.compare_to_baseline(results, baseline)
    for path in (out.results, out.kept):
        csv_tables.write_table(path, results)
    csv_tables.write_table(out.compared, compared)
    markdown.write_comparison(out.text, compared, baseline)
    csv_tables.write_table(out.worth, tables.check_predictions(rounds))
    plots.write_figure(out.plot, rounds, compared, baseline)
