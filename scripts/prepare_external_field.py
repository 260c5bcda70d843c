"""Rule enter_field: a finished field and the surface under it."""

from dav_gswt.field import read_field, write_field
from dav_gswt.geometry.scene_frame import read_scene_frame
from dav_gswt.logs import logging_to
from dav_gswt.reconstruction import external_field, ground
from dav_gswt.reconstruction.fit_settings import FitSettings

with logging_to(snakemake.log[0]):
    quality = FitSettings(**snakemake.params.preset)
    entered, grid = external_field.prepare_external_field(
        read_field(snakemake.input.field), read_scene_frame(snakemake.input.frame), quality
    )
    write_field(entered, snakemake.output.field)
    ground.write_ground(grid, snakemake.output.ground)
