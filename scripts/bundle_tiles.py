"""Rule bundle_tiles: the tiles as a viewer loads them."""

from pathlib import Path

from dav_gswt.bundle import build
from dav_gswt.bundle.content import find_light
from dav_gswt.files import read_json
from dav_gswt.geometry.scene_frame import read_scene_frame
from dav_gswt.logs import logging_to
from dav_gswt.provenance import record_provenance
from dav_gswt.terrain.fit_cover import gather_content
from dav_gswt.tiles import store

with logging_to(snakemake.log[0]):
    paths, params, frame = snakemake.input, snakemake.params, read_scene_frame(snakemake.input.frame)
    inputs = {name: paths[name] for name in ("seams", "frame", "tiles", "levels", "photos")}
    inputs |= {"materials": paths.materials} if paths.get("materials") else {}
    reports = {"tiles": read_json(paths.seams), "levels": read_json(Path(paths.levels, "levels.json"))}
    source = record_provenance(inputs, {"tau": params.tau, "variation": params.variation, "seed": params.seed})
    tiles = store.read_material_tiles(paths.tiles, paths.seams, paths.levels)
    light = find_light(frame, paths.get("materials"), tiles[0].report)
    build.write_bundle(
        gather_content(tiles, paths.get("materials"), params.seed, params.variation),
        Path(snakemake.output.manifest).parent,
        build.BundleOptions(tau=params.tau, salt=params.seed, unit=frame.unit, light=light),
        source | {name: report["provenance"] for name, report in reports.items()},
    )
