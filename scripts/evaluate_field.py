"""Rules evaluate_coarse and evaluate_round: what the test photos say about a field."""

from dav_gswt.field import read_field
from dav_gswt.files import read_json, write_json
from dav_gswt.geometry.scene_frame import read_scene_frame
from dav_gswt.images import lpips_weights
from dav_gswt.logs import logging_to
from dav_gswt.materials.windows import read_windows
from dav_gswt.photos.capture_record import read_capture_record
from dav_gswt.photos.training_views import read_training_views
from dav_gswt.photos.view_split import read_view_split
from dav_gswt.provenance import record_provenance
from dav_gswt.reconstruction import evaluation, ground
from dav_gswt.reconstruction.observation import mask_to_ground
from dav_gswt.reconstruction.windows import mask_to_squares

with logging_to(snakemake.log[0]):
    paths, params = snakemake.input, snakemake.params
    split, captures = read_view_split(paths.views), list(paths.get("captures", []))
    tests = read_training_views(paths.images, paths.model, list(split.test), [], params.preset["fit_size"])
    photos = len(split.start) + sum(len(read_capture_record(folder)) for folder in captures)
    fitted, grid = read_field(paths.field), ground.read_ground(paths.ground)
    perceptual = lpips_weights.read(paths.lpips) if paths.get("lpips") else None
    groups = read_scene_frame(paths.frame).test_groups
    result = evaluation.evaluate_field(fitted, mask_to_ground(tests, grid), groups, perceptual)
    if paths.get("windows"):  # what tiles are cut from, by itself
        squares = [own.exemplar for _, own in read_windows(paths.windows).windows]
        result["windows"] = evaluation.evaluate_field(fitted, mask_to_squares(tests, squares), None, perceptual)
    result |= {"round": params.t, "photos": photos, "gaussians": len(fitted)}
    result |= {"fit": read_json(paths.fit)}
    inputs = {"field": paths.field, "ground": paths.ground, "views": paths.views}
    write_json(snakemake.output.metrics, result | {"provenance": record_provenance(inputs, dict(params.preset))})
