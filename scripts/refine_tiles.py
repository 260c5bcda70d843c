"""Rule refine_tiles: what lies beside the cuts, repaired by a prior."""

from dav_gswt import field, provenance
from dav_gswt.active import imagining
from dav_gswt.coarse import ground
from dav_gswt.logs import logging_to
from dav_gswt.refine import build, repair
from dav_gswt.tiles import store
from dav_gswt.tiles.layout import Exemplar

with logging_to(snakemake.log[0]):
    given, out, params = snakemake.input, snakemake.output, snakemake.params
    tiles, finest = store.read(given.tiles, given.seams), field.read(given.field)
    grid = ground.read(given.ground)
    west, south, _ = grid.exemplar
    uncut = build.Uncut(finest, Exemplar(west, south, grid.spacing, grid.cells))
    model = imagining.opened(params.prior)
    by = repair.ByPrior.of(model, params.refine, params.seed)
    made = build.refined(tiles, uncut, build.Options.of(params.refine), by, model.size)
    inputs = {name: given[name] for name in ("seams", "field", "ground", "weights")}
    about = {"refine": dict(params.refine), "prior": dict(params.prior), "seed": params.seed}
    store.write(made, out.tiles, out.seams, provenance.of(inputs, about))
