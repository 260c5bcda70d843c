"""Rule export_tiles: the tile set for the public GSWT renderer and as a PLY a tile and level."""

from pathlib import Path

from dav_gswt.bundle.store import read_bundle
from dav_gswt.export import gswt
from dav_gswt.logs import logging_to

with logging_to(snakemake.log[0]):
    bundle = read_bundle(Path(snakemake.input.manifest).parent)
    gswt.export_archive(bundle, snakemake.output.archive)
    gswt.export_tiles(bundle, snakemake.output.tiles)
