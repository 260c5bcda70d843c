"""Rule time_library: milliseconds of a frame by the library."""

from pathlib import Path

from dav_gswt import csv_tables
from dav_gswt.bundle import store
from dav_gswt.logs import logging_to
from dav_gswt_study.terrain import frames

with logging_to(snakemake.log[0]):
    bundle = store.read_bundle(Path(snakemake.input.manifest).parent)
    csv_tables.write_table(
        snakemake.output.table, frames.time_library(bundle, frames.FrameSettings(**snakemake.params.asked))
    )
