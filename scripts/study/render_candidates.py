"""Rule render_candidates: what do some candidates truly show?"""

from dav_gswt.files import atomic_folder
from dav_gswt.geometry.scene_frame import read_scene_frame
from dav_gswt.logs import logging_to
from dav_gswt.views import candidates, policy_inputs

with logging_to(snakemake.log[0]):
    scene = snakemake.params.scene
    listed = candidates.list_rendered(scene, read_scene_frame(snakemake.input.frame))
    with atomic_folder(snakemake.output.truth) as folder:
        some = policy_inputs.spread_candidates(listed, snakemake.params.poses)
        policy_inputs.write_truth(folder, policy_inputs.render_truth(scene, some, ""))
