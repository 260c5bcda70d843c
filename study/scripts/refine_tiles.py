"""Rule refine_tiles: a prior refines the seams of a tile set."""

from pathlib import Path

from dav_gswt.lod import store as levels
from dav_gswt.logs import logging_to
from dav_gswt.provenance import record_provenance
from dav_gswt.tiles import store
from dav_gswt.tiles.layout import Exemplar
from dav_gswt.views import prior_sampling
from dav_gswt_study.refine import build, repair

with logging_to(snakemake.log[0]):
    paths, out, params = snakemake.input, snakemake.output, snakemake.params
    tiles, made = store.read_tiles(paths.tiles, paths.seams), levels.read_levels(paths.levels)
    grid = made.grids[0]
    west, south, _ = grid.exemplar
    uncut = build.UncutGround(made.fields[0], Exemplar(west, south, grid.spacing, grid.cells))
    model = prior_sampling.load_prior(params.prior)
    by = repair.PriorRepair.from_config(model, params.refine, params.seed)
    mended = build.refine_tiles(tiles, uncut, build.Options.from_config(params.refine), by, model.size)
    inputs = {name: paths[name] for name in ("seams", "weights")} | {"level0": Path(paths.levels, "level0.ply")}
    about = {"refine": dict(params.refine), "prior": dict(params.prior), "seed": params.seed}
    store.write_tiles([mended], out.tiles, out.seams, record_provenance(inputs, about))
