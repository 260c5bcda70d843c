"""Rules score_coarse and score_round: how much is not known yet at each candidate pose?"""

from dav_gswt import field, images, views
from dav_gswt.active import candidates, frozen, imagining, maps, reach, scores, scoring
from dav_gswt.active.agents import rig
from dav_gswt.coarse import ground
from dav_gswt.files import read_json
from dav_gswt.logs import logging_to

with logging_to(snakemake.log[0]):
    given, out, params = snakemake.input, snakemake.output, snakemake.params
    captures = list(given.get("captures", []))
    scene, frame, split = params.scene, read_json(given.frame), read_json(given.views)
    fitted, grid = field.read(given.field), ground.read(given.ground)
    pool = candidates.left(scene, frame, given.model, split, captures)
    if scene["agent"] != "replay":  # whose frames were all taken, wherever they stand
        pool = rig.within(scene, frame, pool) if scene["agent"] == "serial" else pool
        pool = reach.kept(pool, grid, scene.get("reach"), reach.CLEARANCE * frame["flying_height"])
    taken = views.taken(given.images, given.model, split["start"], captures, scoring.PHOTO)
    prior = imagining.asked(params.prior, params.p_drop, params.seed, given.get("lpips"))
    first = frozen.read(given.frozen) if given.get("frozen") else None
    found = scoring.score(fitted, grid, pool, taken, frame, prior, first)
    scores.write(out.scores, found.scores)
    maps.write(out.maps, found.maps, found.gaussians)
    images.write_exr_parts(out.shown, scoring.parts(found, fitted, grid))
    inputs = {name: given[name] for name in ("field", "ground", "views", "weights", "lpips") if given.get(name)}
    about = {"prior": params.prior, "p_drop": params.p_drop, "seed": params.seed}
    about["variance"] = "posterior" if prior and prior.posterior else "point"
    frozen.write(out.facts, found.frozen, found.facts(), inputs, about)
