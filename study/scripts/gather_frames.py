"""Rule gather_frames: frame times of all scenes, with the columns of each experiment first."""

from dav_gswt.images import figures
from dav_gswt.logs import logging_to
from dav_gswt_study import csv_tables
from dav_gswt_study.terrain import frames

with logging_to(snakemake.log[0]):
    paths, made = snakemake.input, snakemake.output
    found = zip(snakemake.params.cells, paths.page, strict=True)
    rows = [cell | row for cell, path in found for row in csv_tables.read_table(path)]
    for path in (made.table, made.kept):
        csv_tables.write_table(path, rows)
    csv_tables.write_table(made.viewer, frames.select_viewer_rows(rows))
    figures.save_figure(frames.plot_frames(csv_tables.read_table(made.table)), made.plot)
