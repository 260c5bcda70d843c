"""Rule make_examples: what do fields fitted from few photos show of made-up worlds, and what is there?"""

import logging
import os

from dav_gswt.logs import logging_to, progress
from dav_gswt.prior.training import examples

os.environ.setdefault("DAV_GSWT_THREADS", str(snakemake.threads))  # parts are made beside each other

with logging_to(snakemake.log[0]):
    for part in ("coarse", "fitting"):
        logging.getLogger(f"dav_gswt.{part}").setLevel(logging.WARNING)  # else five lines a world
    made = [examples.examples(s, snakemake.params.views) for s in progress(snakemake.params.seeds, "make examples")]
    examples.write(snakemake.output.examples, examples.joined(made))
