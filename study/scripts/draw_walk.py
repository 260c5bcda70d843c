"""Rule draw_walk: the frames of a walk as one moving picture."""

from pathlib import Path

from dav_gswt.logs import logging_to
from dav_gswt_study import gallery

with logging_to(snakemake.log[0]):
    frames = sorted(Path(snakemake.input.frames[0]).glob("*.png"))
    gallery.animate_frames(frames, snakemake.params.rate, snakemake.output.picture)
