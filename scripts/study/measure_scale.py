"""Rule measure_scale: what one fit, render or scoring costs."""

from pathlib import Path

from dav_gswt.field import read_field
from dav_gswt.files import write_json
from dav_gswt.geometry.scene_frame import read_scene_frame
from dav_gswt.logs import logging_to
from dav_gswt.reconstruction import ground
from dav_gswt.reconstruction.fit_settings import CoarseSettings, select_settings
from dav_gswt.study.scale import costs

with logging_to(snakemake.log[0]):
    paths, params, amount = snakemake.input, snakemake.params, int(snakemake.wildcards.amount)
    field, frame = read_field(paths.field), read_scene_frame(paths.frame)
    if params.photos:
        count, size = params.photos
        settings = select_settings(CoarseSettings, params.preset | {"size": size})
        found = costs.measure_fit(field, frame, paths.images[0], count, settings, Path(params.keep))
    elif snakemake.wildcards.what == "gaussians":
        found = costs.measure_render(field, amount)
    else:
        found = costs.measure_scores(field, ground.read_ground(paths.ground), frame, amount)
    write_json(snakemake.output.cost, {"kind": snakemake.wildcards.what} | found)
