"""Rule gather_lod: the tables of levels of several scenes in one."""

import csv
from pathlib import Path

from dav_gswt.logs import logging_to
from dav_gswt.study import figures

with logging_to(snakemake.log[0]):
    found = []
    for path, cell in zip(snakemake.input.tables, snakemake.params.cells, strict=True):
        with Path(path).open(newline="", encoding="utf-8") as file:
            found += [cell | row for row in csv.DictReader(file)]
    figures.write_rows(snakemake.output.table, found)
