"""Rule make_page: viewer and bundle in one folder."""

from pathlib import Path

from dav_gswt.files import read_json
from dav_gswt.logs import logging_to
from dav_gswt.terrain import heights, page, page_story

with logging_to(snakemake.log[0]):
    given, params = snakemake.input, snakemake.params
    surface = heights.surface_from_config(params.heights, read_json(given.manifest)["tile_side"])
    front = page.front_of_scene(snakemake.wildcards.scene, page_story.tell_story(given), given.still)
    viewer = next(Path(path).parent for path in given.viewer if Path(path).name == page.INDEX)
    page.write_page(Path(given.manifest).parent, viewer, snakemake.output.page, surface, params.classes, front)
