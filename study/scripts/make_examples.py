"""Rule make_examples: training examples of the prior, from procedural worlds."""

import logging
import os

from dav_gswt.logs import logging_to, progress
from dav_gswt_study.prior.training import example_files, examples

os.environ.setdefault("DAV_GSWT_THREADS", str(snakemake.threads))  # other parts are made at the same time

with logging_to(snakemake.log[0]):
    logging.getLogger("dav_gswt.reconstruction").setLevel(logging.WARNING)  # else five lines per world
    seeds, views = snakemake.params.seeds, snakemake.params.views
    parts = [examples.make_examples(seed, views) for seed in progress(seeds, "make examples")]
    example_files.write_examples(snakemake.output.examples, example_files.concatenate(parts))
