"""Rules train_prior and train_regressor: from examples to weights."""

from pathlib import Path

from dav_gswt.logs import logging_to
from dav_gswt.prior.training import pipeline
from dav_gswt.prior.training.optimization import Plan
from dav_gswt.study import csv_tables

with logging_to(snakemake.log[0]):
    given, out, params = snakemake.input, snakemake.output, snakemake.params
    plans = Plan(**params.coder), Plan(**params.denoiser)
    coded = given.get("coded")  # a regressor takes the prior's coder
    keep = Path(params.keep)
    losses = pipeline.learn(given.examples, out.weights, *plans, keep, coded, regress=bool(coded))
    rows = [
        {"trained": what, "step": i + 1, "loss": value} for what, of in losses.items() for i, value in enumerate(of)
    ]
    csv_tables.write_table(out.losses, rows)
