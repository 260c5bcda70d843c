"""Rule plot_sphere: what was each candidate worth to each round, and which did it choose?"""

from dav_gswt.geometry.scene_frame import read_scene_frame
from dav_gswt.images import figures
from dav_gswt.logs import logging_to
from dav_gswt.photos.view_split import read_view_split
from dav_gswt.views import candidates, scores
from dav_gswt.views.policies import candidate_values
from dav_gswt.views.selection import read_pose_selection
from dav_gswt_study.views import sphere

with logging_to(snakemake.log[0]):
    paths, lam = snakemake.input, snakemake.params.lam
    frame, split = read_scene_frame(paths.frame), read_view_split(paths.views)
    captures, rounds = list(paths.captures), []
    tables = [scores.read_scores(path) for path in paths.scores]
    for t, (table, poses) in enumerate(zip(tables, paths.poses, strict=True), 1):
        taken = candidates.read_captured_cameras(paths.model, split, captures[: t - 1])
        rounds.append(sphere.build_round(t, table, read_pose_selection(poses).poses, taken, frame, lam))
    figure = sphere.draw_figure(rounds, candidate_values(tables[-1], lam)[0])
    figures.save_figure(figure, snakemake.output.plot)
