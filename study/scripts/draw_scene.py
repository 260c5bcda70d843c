"""Rule draw_scene: a photo of a scene, and its terrain from above and as a walker sees it."""

from pathlib import Path

from dav_gswt.logs import logging_to
from dav_gswt.photos.view_split import read_view_split
from dav_gswt_study import gallery

with logging_to(snakemake.log[0]):
    stills = {Path(path).stem: path for path in snakemake.input.stills}
    photo = Path(snakemake.input.images[0], read_view_split(snakemake.input.views[0]).start[0])
    gallery.draw_scene(photo, stills["above"], stills["walker"], snakemake.output.picture)
