"""Rule select_poses: which k poses should be captured next?"""

import numpy as np

from dav_gswt.geometry.scene_frame import read_scene_frame
from dav_gswt.logs import logging_to
from dav_gswt.photos.view_split import read_view_split
from dav_gswt.views import candidates, scores, selection
from dav_gswt.views.policies import SelectionInput

with logging_to(snakemake.log[0]):
    paths, params, policy = snakemake.input, snakemake.params, snakemake.params.policy
    frame, split, scored = read_scene_frame(paths.frame), read_view_split(paths.views), scores.read_scores(paths.scores)
    taken = candidates.read_captured_cameras(paths.model, split, paths.captures)
    remaining = candidates.list_remaining(params.scene, frame, paths.model, split, paths.captures)
    places = np.array([camera.centre - frame.exemplar.centre for camera in taken]).reshape(-1, 3)
    rng = np.random.default_rng([params.seed, params.t])
    information = selection.build_information_gain(policy, scored, remaining, taken, split, paths)
    chosen = selection.select_poses(policy, scored, SelectionInput(places, params.k, rng, params.lam, information))
    selection.write_pose_selection(snakemake.output.poses, selection.PoseSelection(policy, params.k, chosen))
