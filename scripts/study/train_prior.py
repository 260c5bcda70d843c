"""Rules train_prior and train_regressor: from examples to weights."""

from pathlib import Path

from dav_gswt.logs import logging_to
from dav_gswt.study.prior.training import pipeline
from dav_gswt.study.prior.training.optimization import TrainingPlan

with logging_to(snakemake.log[0]):
    paths, out, params = snakemake.input, snakemake.output, snakemake.params
    plans = TrainingPlan(**params.coder), TrainingPlan(**params.denoiser)
    autoencoder = paths.get("coded")  # a regressor takes the prior's autoencoder
    losses = pipeline.train_prior(paths.examples, out.weights, plans, Path(params.keep), autoencoder)
    pipeline.write_losses(out.losses, losses)
