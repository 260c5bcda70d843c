"""Rule time_page: milliseconds of a frame by the page."""

from pathlib import Path

from dav_gswt import csv_tables
from dav_gswt.files import read_json
from dav_gswt.logs import logging_to
from dav_gswt.terrain import page
from dav_gswt_study.terrain import frames

with logging_to(snakemake.log[0]):
    paths = snakemake.input
    viewer = next(Path(path).parent for path in paths.viewer if Path(path).name == page.INDEX)
    bundle = Path(paths.manifest).parent
    rows = frames.time_page(bundle, viewer, read_json(paths.manifest), frames.FrameSettings(**snakemake.params.asked))
    csv_tables.write_table(snakemake.output.table, rows)
