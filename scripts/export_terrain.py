"""Rule export_terrain: a finite terrain as files of other programs."""

from pathlib import Path

from dav_gswt.bundle import store
from dav_gswt.export import terrain_files
from dav_gswt.geometry.scene_frame import read_scene_frame
from dav_gswt.logs import logging_to
from dav_gswt.terrain import endless

with logging_to(snakemake.log[0]):
    params = snakemake.params
    bundle = store.read_bundle(Path(snakemake.input.manifest).parent)
    terrain = endless.terrain_from_bundle(bundle, params.heights, params.classes)
    reference = read_scene_frame(snakemake.input.frame).georeference
    out, threads = snakemake.output.terrain, snakemake.threads
    terrain_files.export_terrain(terrain, bundle.manifest, params.export, out, threads, reference)
