"""Rule draw_cover: photos above, the terrain that was made of them below."""

from pathlib import Path

from dav_gswt.logs import logging_to
from dav_gswt.photos.view_split import read_view_split
from dav_gswt_study import cover

with logging_to(snakemake.log[0]):
    still = next(path for path in snakemake.input.stills if Path(path).stem == "oblique")
    names = read_view_split(snakemake.input.views[0]).start
    photos = [Path(snakemake.input.images[0], name) for name in names]
    cover.draw_cover(photos, still, snakemake.output.picture)
