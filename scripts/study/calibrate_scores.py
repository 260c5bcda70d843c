"""Rules calibrate_coarse and calibrate_round: do scores say where the field is wrong?"""

from dav_gswt import provenance
from dav_gswt.field import read_field
from dav_gswt.files import read_json, write_json
from dav_gswt.geometry.scene_frame import read_scene_frame
from dav_gswt.logs import logging_to
from dav_gswt.photos import training_views
from dav_gswt.reconstruction import ground
from dav_gswt.study import csv_tables
from dav_gswt.study.calibration import controls, judging
from dav_gswt.views import candidates, pose_maps, prior_sampling, scores, scoring

with logging_to(snakemake.log[0]):
    given, params = snakemake.input, snakemake.params
    captures = list(given.get("captures", []))
    frame, split = read_scene_frame(given.frame), read_json(given.views)
    taken = training_views.taken(given.images, given.model, split["start"], captures, scoring.PHOTO)
    fitted = read_field(given.field), ground.read(given.ground)
    judged = judging.Judged(params.scene, *fitted, frame, taken, params.size)
    pool = candidates.left(params.scene, frame, given.model, split, captures)
    prior = prior_sampling.asked(params.prior, params.p_drop, params.seed, given.get("lpips"))
    others = controls.opened(given.get("regressors", []))
    scored = scores.read(given.scores), pose_maps.read(given.maps)[0]
    some = judging.compared(judged, pool, scored[0], given, params.poses)
    found, rows = judging.calibrated(judged, *some, scored, params.lam, params.seed, prior, others)
    csv_tables.write_table(snakemake.output.poses, rows)
    inputs = {name: given[name] for name in ("field", "ground", "scores", "maps", "views")}
    about = {name: getattr(params, name) for name in ("prior", "p_drop", "lam", "seed", "poses")}
    write_json(snakemake.output.found, found | {"provenance": provenance.of(inputs, about)})
