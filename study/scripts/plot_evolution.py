"""Rules plot_evolution and plot_estimators: test views after rounds, or by the estimator that chose photos."""

from dav_gswt.field import read_field
from dav_gswt.files import read_json
from dav_gswt.geometry.scene_frame import read_scene_frame
from dav_gswt.logs import logging_to
from dav_gswt.photos.training_views import read_training_views
from dav_gswt.reconstruction import ground
from dav_gswt_study.seams import summary
from dav_gswt_study.views import evolution

with logging_to(snakemake.log[0]):
    paths, params = snakemake.input, snakemake.params
    key, found = evolution.psnr_key(read_scene_frame(paths.frame)), []
    names = params.get("named", [""] * len(params.rounds))
    notes = [summary.format_seam_note(crops) for crops in paths.get("crops", [])] or [""] * len(names)
    files = (paths.fields, paths.grounds, paths.metrics)
    for t, name, note, fitted, surface, measured in zip(params.rounds, names, notes, *files, strict=True):
        read = read_field(fitted), ground.read_ground(surface), read_json(measured)
        found.append(evolution.Round(t, *read, title=name, note=note))
    shown = list(evolution.choose_test_views(found[0].metrics, key))
    tests = read_training_views(paths.images, paths.model, shown, [], params.size)
    evolution.write_figure(snakemake.output.plot, evolution.build_strips(found, tests, key), found, key)
