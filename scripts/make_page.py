"""Rule make_page: viewer and bundle in one folder."""

from pathlib import Path

from dav_gswt.files import read_json
from dav_gswt.logs import logging_to
from dav_gswt.terrain import heights, page

with logging_to(snakemake.log[0]):
    given, params = snakemake.input, snakemake.params
    manifest = read_json(given.manifest)
    surface = heights.surface_from_config(params.heights, manifest["tile_side"], manifest["eye_floor"])
    front = page.front_of_scene(snakemake.wildcards.scene, page.tell_story(given), given.still)
    viewer = next(Path(path).parent for path in given.viewer if Path(path).name == page.INDEX)
    bundle, out = Path(given.manifest).parent, snakemake.output.page
    page.write_page(bundle, viewer, out, surface, params.classes, front, params.sun, params.wind)
