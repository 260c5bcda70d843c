"""Rule plot_frames: milliseconds of a frame over Gaussians in view."""

from dav_gswt import csv_tables
from dav_gswt.logs import logging_to
from dav_gswt_study.terrain import frames

with logging_to(snakemake.log[0]):
    rows = csv_tables.read_table(snakemake.input.table)
    for path in (snakemake.output.plot, snakemake.output.kept):
        frames.write_frame_plot(path, rows)
