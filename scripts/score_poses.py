"""Rules score_coarse and score_round: how uncertain is the field at each candidate pose?"""

from dav_gswt.capture.capturing import filter_attainable
from dav_gswt.field import read_field
from dav_gswt.geometry.scene_frame import read_scene_frame
from dav_gswt.images import image_files
from dav_gswt.logs import logging_to
from dav_gswt.photos.training_views import read_training_views
from dav_gswt.photos.view_split import read_view_split
from dav_gswt.reconstruction import ground
from dav_gswt.views import candidates, scores, scoring

with logging_to(snakemake.log[0]):
    paths, out, params = snakemake.input, snakemake.output, snakemake.params
    captures = list(paths.get("captures", []))
    scene, frame, split = params.scene, read_scene_frame(paths.frame), read_view_split(paths.views)
    fitted, grid = read_field(paths.field), ground.read_ground(paths.ground)
    remaining = candidates.list_remaining(scene, frame, paths.model, split, captures)
    remaining = filter_attainable(scene, frame, grid, fitted, remaining)
    taken = read_training_views(paths.images, paths.model, split.start, captures, scoring.PHOTO_WIDTH)
    given, lpips = params.prior, paths.get("lpips")
    prior = scoring.open_prior(given, params.p_drop, params.seed, lpips) if given else None
    first = scores.read_frozen_scales(paths.frozen) if paths.get("frozen") else None
    scored = scoring.score_poses(fitted, grid, remaining, taken, frame, prior, first)
    scores.write_scores(out.scores, scored.scores)
    scores.write_pose_maps(out.maps, scored.maps, scored.gaussians)
    shown = {"uncertainty": scoring.render_above(scored, fitted, grid)}, {"camera": "straight above"}
    image_files.write_exr_parts(out.shown, {"above": shown})
    inputs = {name: paths[name] for name in ("field", "ground", "views", "weights", "lpips") if paths.get(name)}
    about = {"prior": params.prior, "p_drop": params.p_drop, "seed": params.seed}
    scores.write_frozen_scales(out.facts, scored.frozen, scored.scores, inputs, about)
