"""Rule write_materials_page: the page about materials, from its template and its tables."""

from dav_gswt.files import copy_file
from dav_gswt.logs import logging_to
from dav_gswt_study import csv_tables, markdown
from dav_gswt_study.materials import page

with logging_to(snakemake.log[0]):
    paths, out = snakemake.input, snakemake.output
    for name in ("materials", "lattice"):
        copy_file(paths[name], out[name])
    csv_tables.write_table(
        out.verdicts, page.tabulate_verdicts(dict(zip(snakemake.params.scenes, paths.found, strict=True)))
    )
    values = page.describe_materials(out)
    markdown.write_page(out.page, paths.template, values)
