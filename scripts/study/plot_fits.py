"""Rule plot_fits: PSNR of test photos over seconds of fitting."""

from pathlib import Path

from dav_gswt.logs import logging_to
from dav_gswt.study import csv_tables, fit_profile

with logging_to(snakemake.log[0]):
    curves = {
        Path(path).stem.removeprefix("fit_"): csv_tables.read_table(path, texts=()) for path in snakemake.input.curves
    }
    fit_profile.plot_fit_times(curves, snakemake.output.plot)
