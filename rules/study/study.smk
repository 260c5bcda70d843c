"""The study: what the config's `study` compares, and the paper's tables and figures. Not part of `all`.

`snakemake study` makes all of it (with `--max-threads 1` a core to each experiment); `view_benchmark`, `seams`, `tradeoff`,
`stability`, `frame_times`, `presort_table`, `gallery_page`, `perceptual_kit` and `results/sweeps/<name>.png` make parts. Tables and figures are
also kept in docs/research, where runs add up.
"""

from dav_gswt.study.config import FLOOR, expand_study

try:
    config.update(expand_study(config))
except InputError as error:
    raise WorkflowError(str(error)) from None

STUDY = config["study"]  # the study's part of the config
config.update({table: NamedEntries(table, config[table]) for table in ("scenes", "presets", "tilings", "priors")})
STUDY["sweeps"] = NamedEntries("study.sweeps", STUDY["sweeps"])


include: "experiments.smk"
include: "calibration.smk"
include: "view_benchmark.smk"
include: "view_figures.smk"
include: "prior.smk"
include: "expansion.smk"
include: "refine.smk"
include: "levels.smk"
include: "materials.smk"
include: "gallery_cells.smk"
include: "gallery.smk"
include: "presort.smk"
include: "frames.smk"
include: "fits.smk"
include: "cells.smk"
include: "scale.smk"
include: "raster_profile.smk"
include: "peers.smk"
include: "seams.smk"
include: "forced_choice.smk"
include: "sweeps.smk"
include: "tables.smk"
include: "tradeoff.smk"
include: "preset_experiments.smk"
include: "preset_costs.smk"
include: "stability.smk"
include: "inspection.smk"
include: "rover.smk"
include: "exits.smk"
include: "results.smk"
