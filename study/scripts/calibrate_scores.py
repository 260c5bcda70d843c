"""Rules calibrate_coarse and calibrate_round: do scores say where the field is wrong?"""

from dav_gswt.files import write_json
from dav_gswt.logs import logging_to
from dav_gswt.photos.view_split import read_view_split
from dav_gswt.provenance import record_provenance
from dav_gswt.views import candidates, scores
from dav_gswt_study import csv_tables
from dav_gswt_study.calibration import judging

with logging_to(snakemake.log[0]):
    paths, params = snakemake.input, snakemake.params
    captures = list(paths.get("captures", []))
    split = read_view_split(paths.views)
    judged = judging.read_target(paths, split, captures, params.size)
    remaining = candidates.list_remaining(params.scene, judged.frame, paths.model, split, captures)
    scored = scores.read_scores(paths.scores), scores.read_pose_maps(paths.maps)[0]
    some = judging.choose_candidates(remaining, scored[0], paths.images, params.poses)
    found, rows = judging.calibrate_scores(judged, *some, scored, params.lam, params.seed)
    csv_tables.write_table(snakemake.output.poses, rows)
    inputs = {name: paths[name] for name in ("field", "ground", "scores", "maps", "views")}
    about = {name: getattr(params, name) for name in ("lam", "seed", "poses")}
    write_json(snakemake.output.found, found | {"provenance": record_provenance(inputs, about)})
