"""Rule bundle_tiles: the tiles as a viewer loads them, and as the public GSWT renderer does."""

from pathlib import Path

from dav_gswt.bundle import build
from dav_gswt.files import read_json
from dav_gswt.geometry.scene_frame import read_scene_frame
from dav_gswt.logs import logging_to
from dav_gswt.provenance import record_provenance
from dav_gswt.tiles import store

with logging_to(snakemake.log[0]):
    given, params, frame = snakemake.input, snakemake.params, read_scene_frame(snakemake.input.frame)
    inputs = {name: given[name] for name in ("seams", "frame", "tiles", "levels", "photos")}
    told = {"tiles": read_json(given.seams), "levels": read_json(Path(given.levels, "levels.json"))}
    source = record_provenance(inputs, {"tau": params.tau, "seed": params.seed})
    build.write_bundle(
        store.read_tiles(given.tiles, given.seams),
        Path(snakemake.output.manifest).parent,
        build.BundleOptions(tau=params.tau, salt=params.seed, unit=frame.unit, threads=snakemake.threads),
        params.schema,
        source | {name: table["provenance"] for name, table in told.items()},
    )
