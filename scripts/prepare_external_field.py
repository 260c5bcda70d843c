"""Rule prepare_external_field: a finished field and the surface under it."""

from dav_gswt.field import read_field, write_field
from dav_gswt.geometry.scene_frame import read_scene_frame
from dav_gswt.logs import logging_to
from dav_gswt.reconstruction import coarse, ground

with logging_to(snakemake.log[0]):
    entered, grid = coarse.prepare_external_field(
        read_field(snakemake.input.field),
        read_scene_frame(snakemake.input.frame),
        snakemake.params.preset["max_gaussians"],
    )
    write_field(entered, snakemake.output.field)
    ground.write_ground(grid, snakemake.output.ground)
