"""Rule write_results: the page of the study's tables and figures."""

from pathlib import Path

from dav_gswt.files import copy_file
from dav_gswt.logs import logging_to
from dav_gswt.study import csv_tables, figures
from dav_gswt.study.tables import results

with logging_to(snakemake.log[0]):
    given, out, params = snakemake.input, snakemake.output, snakemake.params
    for source, target in zip(given.figures, out.figures, strict=True):
        figures.kept(source, target)
    copy_file(given.lod, out.lod)
    shown = {about: f"../figures/{Path(path).name}" for about, path in zip(params.shown, out.figures, strict=True)}
    names = ("timing", "lod", "sensitivity", "ablation")
    results.write(out.page, {name: csv_tables.read_table(given[name]) for name in names}, shown)
