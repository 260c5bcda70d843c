"""Rule profile_rasterizer: milliseconds of the rasterizer's stages."""

from dav_gswt import csv_tables
from dav_gswt.field import read_field
from dav_gswt.geometry.scene_frame import read_scene_frame
from dav_gswt.logs import logging_to
from dav_gswt.provenance import describe_machine, record_provenance
from dav_gswt_study import markdown, raster_profile

with logging_to(snakemake.log[0]):
    paths, out = snakemake.input, snakemake.output
    field, frame = read_field(paths.field), read_scene_frame(paths.frame)
    rows = raster_profile.profile_rasterizer(field, frame, snakemake.params.size)
    csv_tables.write_table(out.table, rows)
    raster_profile.plot_stages(rows, out.plot)
    made = record_provenance({"field": paths.field}, {}) | describe_machine()
    values = raster_profile.describe_profile(rows) | {key: made[key] for key in ("version", "cores", "processor")}
    markdown.write_page(out.page, markdown.render_template(paths.template, values))
