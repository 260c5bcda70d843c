"""Rule render_scale_photos: photos of a field."""

from pathlib import Path

from dav_gswt.field import read_field
from dav_gswt.geometry.scene_frame import read_scene_frame
from dav_gswt.logs import logging_to
from dav_gswt_study.scale.photos import render_photos

with logging_to(snakemake.log[0]):
    paths, cell = snakemake.input, snakemake.wildcards
    folder = Path(snakemake.output.images)
    folder.mkdir(parents=True, exist_ok=True)
    render_photos(read_field(paths.field), read_scene_frame(paths.frame), int(cell.amount), int(cell.pixels), folder)
