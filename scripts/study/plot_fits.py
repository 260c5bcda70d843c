"""Rule plot_fits: PSNR of test photos over seconds of fitting."""

from pathlib import Path

from dav_gswt.logs import logging_to
from dav_gswt.study import csv_tables, figures

with logging_to(snakemake.log[0]):
    curves = {
        Path(path).stem.removeprefix("fit_"): csv_tables.read_table(path, texts=()) for path in snakemake.input.curves
    }
    figures.fit_time(curves, snakemake.output.plot)
