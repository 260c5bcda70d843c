"""Rule export_plys: a patch of terrain at each level."""

from pathlib import Path

from dav_gswt.bundle import manifest
from dav_gswt.export import terrain_files
from dav_gswt.logs import logging_to

with logging_to(snakemake.log[0]):
    bundle = manifest.read_manifest(Path(snakemake.input.manifest).parent)
    terrain_files.write_plys(snakemake.input.archive, bundle.tile_side, snakemake.output.plys)
