"""Rule compare_policies: from curves to tables and a figure."""

from dav_gswt.logs import logging_to
from dav_gswt.study import csv_tables
from dav_gswt.study.comparison import curves, markdown, plots, tables

with logging_to(snakemake.log[0]):
    out, baseline = snakemake.output, snakemake.params.baseline
    rounds = curves.read(snakemake.input.curves)
    results = tables.results(rounds)
    compared = tables.comparisons(results, baseline)
    for path in (out.results, out.kept):
        csv_tables.write_table(path, results)
    csv_tables.write_table(out.compared, compared)
    markdown.write(out.text, compared, baseline)
    csv_tables.write_table(out.worth, tables.worth(rounds))
    plots.write(out.plot, rounds, compared, baseline)
