"""Rule gather_comparison: the experiments of a sweep as one table, added to that of earlier runs, and as a figure."""

from dav_gswt.images import figures
from dav_gswt.logs import logging_to
from dav_gswt_study import csv_tables, sweeps

with logging_to(snakemake.log[0]):
    out, params = snakemake.output, snakemake.params
    rows = [sweeps.tabulate_experiment(cell) for cell in params.cells]
    csv_tables.write_table(out.table, rows)
    csv_tables.update_table(out.kept, rows, sweeps.KEY)
    figure = sweeps.draw_figure(snakemake.wildcards.sweep, params.axes, sweeps.read_sweep(out.table))
    figures.save_figure(figure, out.plot)
