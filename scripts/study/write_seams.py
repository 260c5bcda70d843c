"""Rule write_seams: the page of seams with its pictures."""

from pathlib import Path

from dav_gswt.logs import logging_to
from dav_gswt.study import figures
from dav_gswt.study.markdown import write_page
from dav_gswt.study.seams import page, tables

with logging_to(snakemake.log[0]):
    given, out, params = snakemake.input, snakemake.output, snakemake.params
    figures.save(figures.sheet(params.pictures, list(page.SHOT_CAPTIONS.values())), out.sheet)
    pictures = {
        f"../figures/{Path(given.ablation).name}": "Every variant minus the baseline, in three measures",
        f"../figures/{Path(out.sheet).name}": "Twenty by twenty tiles from above, and at walker height",
    }
    rows = tuple(tables.read_seam_table(path) for path in given.tables)
    write_page(out.page, page.format_seam_page(given.template, rows, params.own, pictures))
