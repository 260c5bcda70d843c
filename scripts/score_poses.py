"""Rules score_coarse and score_round: how much is not known yet at each candidate pose?"""

from dav_gswt.capture import serial_rig
from dav_gswt.field import read_field
from dav_gswt.geometry.scene_frame import read_scene_frame
from dav_gswt.images import image_files
from dav_gswt.logs import logging_to
from dav_gswt.photos.training_views import read_training_views
from dav_gswt.photos.view_split import read_view_split
from dav_gswt.reconstruction import ground
from dav_gswt.views import candidates, feasibility, frozen_scales, pose_maps, prior_sampling, scores, scoring

with logging_to(snakemake.log[0]):
    given, out, params = snakemake.input, snakemake.output, snakemake.params
    captures = list(given.get("captures", []))
    scene, frame, split = params.scene, read_scene_frame(given.frame), read_view_split(given.views)
    fitted, grid = read_field(given.field), ground.read_ground(given.ground)
    pool = candidates.list_remaining(scene, frame, given.model, split, captures)
    if scene["agent"] != "replay":  # whose frames were all taken, wherever they stand
        pool = serial_rig.filter_reachable(scene, frame, pool) if scene["agent"] == "serial" else pool
        pool = feasibility.filter_feasible(
            pool, grid, scene.get("feasibility"), feasibility.CLEARANCE * frame.flying_height
        )
    taken = read_training_views(given.images, given.model, split.start, captures, scoring.PHOTO_WIDTH)
    prior = prior_sampling.open_scoring_prior(params.prior, params.p_drop, params.seed, given.get("lpips"))
    first = frozen_scales.read_frozen_scales(given.frozen) if given.get("frozen") else None
    found = scoring.score_poses(fitted, grid, pool, taken, frame, prior, first)
    scores.write_scores(out.scores, found.scores)
    pose_maps.write_pose_maps(out.maps, found.maps, found.gaussians)
    image_files.write_exr_parts(out.shown, scoring.exr_parts(found, fitted, grid))
    inputs = {name: given[name] for name in ("field", "ground", "views", "weights", "lpips") if given.get(name)}
    about = {"prior": params.prior, "p_drop": params.p_drop, "seed": params.seed}
    about["variance"] = "posterior" if prior and prior.posterior else "point"
    frozen_scales.write_frozen_scales(out.facts, found.frozen, found.describe(), inputs, about)
