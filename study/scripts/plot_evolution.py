"""Rule plot_evolution: how do two test views change from round to round?"""

from dav_gswt.field import read_field
from dav_gswt.files import read_json
from dav_gswt.geometry.scene_frame import read_scene_frame
from dav_gswt.logs import logging_to
from dav_gswt.photos.training_views import read_training_views
from dav_gswt.reconstruction import ground
from dav_gswt_study.views import evolution

with logging_to(snakemake.log[0]):
    paths, params = snakemake.input, snakemake.params
    key, rounds = evolution.psnr_key(read_scene_frame(paths.frame)), []
    for t, *files in zip(params.rounds, paths.fields, paths.grounds, paths.metrics, strict=True):
        fitted, surface, measured = files
        rounds.append(evolution.Round(t, read_field(fitted), ground.read_ground(surface), read_json(measured)))
    names = list(evolution.choose_test_views(rounds[0].metrics, key))
    tests = read_training_views(paths.images, paths.model, names, [], params.size)
    evolution.write_figure(snakemake.output.plot, evolution.build_strips(rounds, tests, key), rounds, key)
