"""Rule make_contact_sheet: the terrain's stills beside each other."""

from pathlib import Path

from dav_gswt.images import figures
from dav_gswt.logs import logging_to

with logging_to(snakemake.log[0]):
    stills = snakemake.input.stills
    names = [Path(path).stem for path in stills]
    figures.save_figure(figures.draw_sheet({snakemake.wildcards.scene: stills}, names, 3.2), snakemake.output.sheet)
