"""Rule train_prior: the project's own prior, from examples to weights."""

from pathlib import Path

from dav_gswt import figures
from dav_gswt.logs import logging_to
from dav_gswt.prior import lesson
from dav_gswt.prior.training import Plan

with logging_to(snakemake.log[0]):
    out, params = snakemake.output, snakemake.params
    plans = Plan(**params.coder), Plan(**params.denoiser)
    losses = lesson.learn(list(snakemake.input.examples), out.weights, *plans, Path(params.keep))
    rows = [
        {"trained": what, "step": i + 1, "loss": value} for what, of in losses.items() for i, value in enumerate(of)
    ]
    figures.write_rows(out.losses, rows)
