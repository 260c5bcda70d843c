"""Rule write_results: the page of the study's tables and figures."""

from pathlib import Path

from dav_gswt.files import copy_file
from dav_gswt.logs import logging_to
from dav_gswt_study import csv_tables
from dav_gswt_study.figures import copy_figure
from dav_gswt_study.markdown import write_page
from dav_gswt_study.tables import results

with logging_to(snakemake.log[0]):
    paths, out, params = snakemake.input, snakemake.output, snakemake.params
    for source, target in zip(paths.figures, out.figures, strict=True):
        copy_figure(source, target)
    copy_file(paths.lod, out.lod)
    tables = {name: csv_tables.read_table(paths[name]) for name in ("timing", "lod", "sensitivity", "ablation")}
    shown = {about: f"../figures/{Path(path).name}" for about, path in zip(params.shown, out.figures, strict=True)}
    write_page(out.page, paths.template, results.describe_results(tables) | {"figures": shown})
