"""Rule draw_materials_sheet: materials over the ground, and the terrain made of them."""

from pathlib import Path

from dav_gswt.images import figures
from dav_gswt.logs import logging_to

with logging_to(snakemake.log[0]):
    stills = {Path(path).stem: path for path in snakemake.input.stills}
    pictures = [
        Path(snakemake.input.materials[0], "materials.png"),
        snakemake.input.above[0],
        stills["oblique"],
        stills["walker"],
    ]
    heads = ["ground and what was found", "20 x 20 tiles", "oblique", "walker"]
    figures.save_figure(figures.draw_sheet({snakemake.wildcards.shown: pictures}, heads, 2.6), snakemake.output.sheet)
