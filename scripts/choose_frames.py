"""Rule choose_frames: sharp frames of a video, each a little farther along than the one before."""

from dav_gswt.logs import logging_to
from dav_gswt.photos.video import write_frames

with logging_to(snakemake.log[0]):
    write_frames(snakemake.input[0], snakemake.output.frames, snakemake.threads)
