"""Rule select_poses: which k poses should be captured next?"""

import numpy as np

from dav_gswt import images
from dav_gswt.active import candidates, maps, poses, scores, selection
from dav_gswt.files import read_json, write_json
from dav_gswt.logs import logging_to

with logging_to(snakemake.log[0]):
    given, params = snakemake.input, snakemake.params
    taken = candidates.places_taken(read_json(given.frame), given.model, read_json(given.views), given.captures)
    wanted = selection.Wanted(taken, params.k, np.random.default_rng([params.seed, params.t]), params.lam)
    scored = scores.read(given.scores)
    chosen = selection.select(params.policy, scored, wanted)
    write_json(snakemake.output.poses, poses.to_json(chosen, policy=params.policy, k=params.k))
    shown = maps.read(given.maps)[0].parts(scored, [pose.name for pose in chosen])
    images.write_exr_parts(snakemake.output.shown, shown or maps.NOTHING)
