"""Rule cut_tiles: sixteen tiles (times the variants) of each material, at every level, cut on the finest."""

from pathlib import Path

from dav_gswt.files import locate_path
from dav_gswt.images import lpips_weights
from dav_gswt.lod import store as levels
from dav_gswt.logs import logging_to
from dav_gswt.materials.store import read_report
from dav_gswt.provenance import record_provenance
from dav_gswt.tiles import build, semantics, store

with logging_to(snakemake.log[0]):
    paths, tiling = snakemake.input, snakemake.params.tiling
    sets = levels.read_material_levels(paths.levels)
    alexnet = lpips_weights.read(paths.lpips) if paths.get("lpips") else None
    source = semantics.SemanticSource(alexnet, locate_path(tiling["sam2"]) if "sam2" in tiling else None)
    options = build.TilingOptions.from_config(tiling, source, sets[0].wanted)
    side = read_report(paths.materials).tile_side if paths.get("materials") else None
    tiles = build.cut_materials(sets, options, side, lambda k: build.make_generator(snakemake.params.seed, tiling, k))
    files = sorted(Path(paths.levels).rglob("level*.ply"))
    inputs = {path.relative_to(paths.levels).with_suffix("").as_posix(): path for path in files}
    inputs |= {name: paths[name] for name in ("lpips", "sam2") if paths.get(name)}
    record = record_provenance(inputs, dict(tiling))
    store.write_tiles(tiles, snakemake.output.tiles, snakemake.output.seams, record)
