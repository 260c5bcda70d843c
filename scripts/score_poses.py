"""Rules score_coarse and score_round: how much is not known yet at each candidate pose?"""

from dav_gswt import field, images
from dav_gswt.active import candidates, poses, reach, scoring
from dav_gswt.active.agents import rig
from dav_gswt.coarse import ground
from dav_gswt.files import read_json
from dav_gswt.logs import logging_to

with logging_to(snakemake.log[0]):
    given = snakemake.input
    captures = given.get("captures", [])
    captures = [captures] if isinstance(captures, str) else list(captures)
    scene, frame = snakemake.params.scene, read_json(given.frame)
    pool = candidates.left(scene, frame, given.model, read_json(given.views), captures)
    fitted, grid = field.read(given.field), ground.read(given.ground)
    if scene["agent"] != "replay":  # whose frames were all taken, wherever they stand
        pool = rig.within(scene, frame, pool) if scene["agent"] == "serial" else pool
        pool = reach.kept(pool, grid, scene.get("reach"), reach.CLEARANCE * frame["flying_height"])
    scored, maps = scoring.score(fitted, grid, pool)
    poses.write_scores(snakemake.output.scores, scored)
    images.write_exr_parts(snakemake.output.maps, scoring.parts(fitted, grid, scored, maps))
