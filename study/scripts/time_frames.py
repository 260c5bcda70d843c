"""Rules time_library and time_page: milliseconds of a frame by the library, or by the page where a viewer is given."""

from pathlib import Path

from dav_gswt.bundle import store
from dav_gswt.files import read_json
from dav_gswt.logs import logging_to
from dav_gswt.terrain import page
from dav_gswt_study import csv_tables
from dav_gswt_study.terrain import frames

with logging_to(snakemake.log[0]):
    paths, settings = snakemake.input, frames.FrameSettings(**snakemake.params.asked)
    bundle = Path(paths.manifest).parent
    if paths.get("viewer"):
        viewer = next(Path(path).parent for path in paths.viewer if Path(path).name == page.INDEX)
        rows = frames.time_page(bundle, viewer, read_json(paths.manifest), settings)
    else:
        rows = frames.time_library(store.read_bundle(bundle), settings)
    csv_tables.write_table(snakemake.output.table, rows)
