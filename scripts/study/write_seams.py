"""Rule write_seams: what was found of seams, as a page to read with its pictures."""

from pathlib import Path

from dav_gswt.logs import logging_to
from dav_gswt.study import figures
from dav_gswt.study.seams import page, tables

with logging_to(snakemake.log[0]):
    given, out, params = snakemake.input, snakemake.output, snakemake.params
    figures.save(figures.sheet(params.pictures, list(page.SHOTS.values())), out.sheet)
    pictures = {
        f"../figures/{Path(given.ablation).name}": "Every way to cut less the baseline, in three measures",
        f"../figures/{Path(out.sheet).name}": "Twenty by twenty tiles from above, and what a walker sees of them",
    }
    page.write(out.page, page.text(*(tables.read(path) for path in given.tables), params.own, pictures))
