"""Rule cut_tiles_by_expansion: the tiles of a tiling with `energy: expansion`."""

from pathlib import Path

from dav_gswt.images import lpips_weights
from dav_gswt.lod import store as levels
from dav_gswt.logs import logging_to
from dav_gswt.provenance import record_provenance
from dav_gswt.study import expansion
from dav_gswt.tiles import build, semantics, store

with logging_to(snakemake.log[0]):
    paths, tiling = snakemake.input, snakemake.params.tiling
    made = levels.read_levels(paths.levels)
    alexnet = lpips_weights.read(paths.lpips) if paths.get("lpips") else None
    source = semantics.SemanticSource(alexnet, tiling.get("sam2"))
    options = build.TilingOptions.from_config(tiling | {"energy": "semantic"}, source, made.wanted)
    tiles = expansion.cut_by_expansion(made, options, build.make_generator(snakemake.params.seed, tiling))
    inputs = {f"level{number}": Path(paths.levels, f"level{number}.ply") for number in range(len(made.fields))}
    inputs |= {name: paths[name] for name in ("lpips", "sam2") if paths.get(name)}
    store.write_tiles([tiles], snakemake.output.tiles, snakemake.output.seams, record_provenance(inputs, dict(tiling)))
