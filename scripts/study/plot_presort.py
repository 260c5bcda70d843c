"""Rule plot_presort: what the page's shortcuts do to pictures of several scenes."""

import csv
from pathlib import Path

from dav_gswt.files import copied
from dav_gswt.logs import logging_to
from dav_gswt.study.terrain import shortcuts

with logging_to(snakemake.log[0]), Path(snakemake.input.table).open(newline="", encoding="utf-8") as file:
    shortcuts.write_plot(snakemake.output.plot, list(csv.DictReader(file)))
    copied(snakemake.output.plot, snakemake.output.kept)
    copied(snakemake.input.table, snakemake.output.data)
