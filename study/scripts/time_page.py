"""Rule time_page: milliseconds of a frame of the page."""

from pathlib import Path

from dav_gswt.files import read_json
from dav_gswt.logs import logging_to
from dav_gswt.terrain import page
from dav_gswt_study import csv_tables
from dav_gswt_study.terrain import frames

with logging_to(snakemake.log[0]):
    paths, settings = snakemake.input, frames.FrameSettings(**snakemake.params.asked)
    viewer = next(Path(path).parent for path in paths.viewer if Path(path).name == page.INDEX)
    rows = frames.time_page(Path(paths.manifest).parent, viewer, read_json(paths.manifest), settings)
    csv_tables.write_table(snakemake.output.table, rows)
