"""Rule plot_estimators: test views of fields whose photos different estimators chose."""

from dav_gswt.field import read_field
from dav_gswt.files import read_json
from dav_gswt.geometry.scene_frame import read_scene_frame
from dav_gswt.logs import logging_to
from dav_gswt.photos.training_views import read_training_views
from dav_gswt.reconstruction import ground
from dav_gswt_study.tables import estimators
from dav_gswt_study.views import evolution

with logging_to(snakemake.log[0]):
    paths, params = snakemake.input, snakemake.params
    key, found = evolution.psnr_key(read_scene_frame(paths.frame)), []
    for name, *files in zip(params.named, paths.fields, paths.grounds, paths.metrics, paths.crops, strict=True):
        fitted, surface, measured, crops = files
        read = read_field(fitted), ground.read_ground(surface), read_json(measured)
        found.append(evolution.Round(params.rounds, *read, title=name, note=estimators.format_seam_note(crops)))
    names = list(evolution.choose_test_views(found[0].metrics, key))
    tests = read_training_views(paths.images, paths.model, names, [], params.size)
    evolution.write_figure(snakemake.output.plot, evolution.build_strips(found, tests, key), found, key)
