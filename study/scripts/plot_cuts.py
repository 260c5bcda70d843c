"""Rule plot_cuts: cuts of the same tiles by colour alone and by semantics."""

from dav_gswt.logs import logging_to
from dav_gswt.tiles import store
from dav_gswt_study.seams import report

with logging_to(snakemake.log[0]):
    paths = snakemake.input
    pair = [store.read_tiles(*files, paths.levels) for files in zip(paths.tiles, paths.seams, strict=True)]
    report.write_cuts(snakemake.output.plot, dict(zip(("colour", "semantic"), pair, strict=True)))
