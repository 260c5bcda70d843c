"""Rule make_kit: the pairs of all scenes as an offline page, and its key."""

from pathlib import Path

from dav_gswt.logs import logging_to
from dav_gswt_study.forced_choice import kit

with logging_to(snakemake.log[0]):
    paths, params = snakemake.input, snakemake.params
    drawn = [pair for item in zip(paths.pairs, params.scenes, strict=True) for pair in kit.read_pairs(*item)]
    parts = Path(paths.parts[0]).parent
    kit.write_kit(snakemake.output.page, snakemake.output.key, parts, drawn, params.seed, kit.SECONDS)
