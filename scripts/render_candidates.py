"""Rule render_candidates: what do some candidates truly show?"""

from dav_gswt.files import atomic_folder
from dav_gswt.geometry.scene_frame import read_scene_frame
from dav_gswt.logs import logging_to
from dav_gswt.views import candidates, true_pictures

with logging_to(snakemake.log[0]):
    scene = snakemake.params.scene
    listed = candidates.list_rendered(scene, read_scene_frame(snakemake.input.frame))
    with atomic_folder(snakemake.output.truth) as folder:
        some = true_pictures.spread_candidates(listed, snakemake.params.poses)
        true_pictures.write_truth(folder, true_pictures.render_truth(scene, some, ""))
