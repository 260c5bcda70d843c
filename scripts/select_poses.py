"""Rule select_poses: which k poses should be captured next?"""

import numpy as np

from dav_gswt.active import candidates, poses, selection
from dav_gswt.files import read_json, write_json
from dav_gswt.logs import logging_to

with logging_to(snakemake.log[0]):
    given, params = snakemake.input, snakemake.params
    taken = candidates.places_taken(read_json(given.frame), given.model, read_json(given.views), given.captures)
    rng = np.random.default_rng([params.seed, params.t])
    chosen = selection.select(params.policy, poses.read_scores(given.scores), taken, params.k, rng)
    write_json(snakemake.output.poses, poses.to_json(chosen, policy=params.policy, k=params.k))
