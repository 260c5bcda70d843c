"""Rule make_page: viewer and bundle in one folder."""

from pathlib import Path

from dav_gswt.files import read_json
from dav_gswt.logs import logging_to
from dav_gswt.terrain import heights, page

with logging_to(snakemake.log[0]):
    bundle, viewer = Path(snakemake.input.manifest).parent, page.find_viewer(snakemake.input.viewer)
    surface = heights.surface_from_config(snakemake.params.heights, read_json(snakemake.input.manifest)["tile_side"])
    page.write_page(bundle, viewer, snakemake.output.page, surface, snakemake.params.classes)
