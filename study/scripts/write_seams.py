"""Rule write_seams: the page of seams with its pictures."""

from pathlib import Path

from dav_gswt.images import figures
from dav_gswt.logs import logging_to
from dav_gswt_study.markdown import write_page
from dav_gswt_study.seams import page, tables

with logging_to(snakemake.log[0]):
    paths, out, params = snakemake.input, snakemake.output, snakemake.params
    figures.save_figure(figures.draw_sheet(params.pictures, list(page.SHOT_CAPTIONS.values())), out.sheet)
    pictures = {
        f"../figures/{Path(paths.ablation).name}": "Every variant minus the baseline, in three measures",
        f"../figures/{Path(out.sheet).name}": "Twenty by twenty tiles from above, and at walker height",
    }
    rows = tuple(tables.read_seam_table(path) for path in paths.tables)
    write_page(out.page, page.format_seam_page(paths.template, rows, params.own, pictures))
