"""Rule evaluate_prior: the accuracy of the prior on held-out worlds, compared with cheaper estimates."""

from dav_gswt import csv_tables
from dav_gswt.images import lpips_weights
from dav_gswt.logs import logging_to
from dav_gswt.prior.terrain import TerrainPrior
from dav_gswt_study.prior import evaluation, plots
from dav_gswt_study.prior.training import example_files

with logging_to(snakemake.log[0]):
    paths, out, params = snakemake.input, snakemake.output, snakemake.params
    setting = evaluation.Setting(**params.setting)
    prior = TerrainPrior.open(paths.weights)
    made = example_files.concatenate([example_files.read_examples(part) for part in paths.examples])
    perceptual = lpips_weights.read(*paths.lpips) if paths.lpips else None  # a list of none or one
    rows = evaluation.evaluate_prior(evaluation.select_evenly(made, params.views), prior, setting, perceptual)
    csv_tables.write_table(out.table, rows)
    shown = evaluation.select_evenly(made, params.shown)
    plots.plot_samples(plots.make_gallery(shown, prior, setting), out.samples)
