"""Rule train_prior: from examples to weights."""

from pathlib import Path

from dav_gswt.logs import logging_to
from dav_gswt_study.prior.training import optimization
from dav_gswt_study.prior.training.optimization import TrainingPlan

with logging_to(snakemake.log[0]):
    paths, out, params = snakemake.input, snakemake.output, snakemake.params
    plans = TrainingPlan(**params.coder), TrainingPlan(**params.denoiser)
    losses = optimization.train_prior(paths.examples, out.weights, plans, Path(params.keep))
    optimization.write_losses(out.losses, losses)
