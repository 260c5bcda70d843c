"""Rule select_poses: which k poses should be captured next?"""

import numpy as np

from dav_gswt import images
from dav_gswt.active import candidates, maps, needs, poses, scores, selection
from dav_gswt.active.policies import Wanted
from dav_gswt.files import read_json, write_json
from dav_gswt.logs import logging_to

with logging_to(snakemake.log[0]):
    given, params = snakemake.input, snakemake.params
    frame, split, scored = read_json(given.frame), read_json(given.views), scores.read(given.scores)
    taken = candidates.taken(given.model, split, given.captures)
    pool = candidates.left(params.scene, frame, given.model, split, given.captures)
    wanted = Wanted(
        candidates.places(taken, frame),
        params.k,
        np.random.default_rng([params.seed, params.t]),
        params.lam,
        needs.information(params.policy, scored, pool, taken, given.field),
        needs.errors(params.policy, scored, pool, given, params.scene, params.size),
    )
    chosen = selection.select(params.policy, scored, wanted)
    write_json(snakemake.output.poses, poses.to_json(chosen, policy=params.policy, k=params.k))
    shown = maps.read(given.maps)[0].parts(scored, [pose.name for pose in chosen])
    images.write_exr_parts(snakemake.output.shown, shown or maps.NOTHING)
