"""Rules calibrate_coarse and calibrate_round: do scores say where the field is wrong?"""

from dav_gswt.field import read_field
from dav_gswt.files import write_json
from dav_gswt.geometry.scene_frame import read_scene_frame
from dav_gswt.logs import logging_to
from dav_gswt.photos.training_views import read_training_views
from dav_gswt.photos.view_split import read_view_split
from dav_gswt.provenance import record_provenance
from dav_gswt.reconstruction import ground
from dav_gswt.study import csv_tables
from dav_gswt.study.calibration import controls, judging
from dav_gswt.views import candidates, pose_maps, prior_sampling, scores, scoring

with logging_to(snakemake.log[0]):
    given, params = snakemake.input, snakemake.params
    captures = list(given.get("captures", []))
    frame, split = read_scene_frame(given.frame), read_view_split(given.views)
    taken = read_training_views(given.images, given.model, split.start, captures, scoring.PHOTO_WIDTH)
    fitted = read_field(given.field), ground.read_ground(given.ground)
    judged = judging.CalibrationTarget(params.scene, *fitted, frame, taken, params.size)
    pool = candidates.list_remaining(params.scene, frame, given.model, split, captures)
    prior = prior_sampling.open_scoring_prior(params.prior, params.p_drop, params.seed, given.get("lpips"))
    others = controls.open_regressors(given.get("regressors", []))
    scored = scores.read_scores(given.scores), pose_maps.read_pose_maps(given.maps)[0]
    some = judging.choose_candidates(judged, pool, scored[0], given, params.poses)
    found, rows = judging.calibrate_scores(judged, *some, scored, params.lam, params.seed, prior, others)
    csv_tables.write_table(snakemake.output.poses, rows)
    inputs = {name: given[name] for name in ("field", "ground", "scores", "maps", "views")}
    about = {name: getattr(params, name) for name in ("prior", "p_drop", "lam", "seed", "poses")}
    write_json(snakemake.output.found, found | {"provenance": record_provenance(inputs, about)})
