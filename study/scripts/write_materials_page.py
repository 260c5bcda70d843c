"""Rule write_materials_page: the page about materials, from its template and its tables."""

from dav_gswt.logs import logging_to
from dav_gswt_study import markdown
from dav_gswt_study.materials import page

with logging_to(snakemake.log[0]):
    paths = snakemake.input
    tables = {name: paths[name] for name in ("materials", "lattice", "verdicts")}
    values = page.describe_materials(tables)
    markdown.write_page(snakemake.output.page, markdown.render_template(paths.template, values))
