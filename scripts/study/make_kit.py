"""Rule make_kit: all scenes' pairs as a page to be answered, and the key to it."""

from pathlib import Path

from dav_gswt.logs import logging_to
from dav_gswt.study.forced_choice import kit, store, trials

with logging_to(snakemake.log[0]):
    given, params = snakemake.input, snakemake.params
    drawn = [pair for item in zip(given.pairs, params.scenes, strict=True) for pair in store.read(*item)]
    parts = Path(given.parts[0]).parent
    kit.write(snakemake.output.page, snakemake.output.key, parts, drawn, params.seed, trials.SECONDS)
