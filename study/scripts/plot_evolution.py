"""Rules plot_evolution and plot_estimators: two test views after several rounds, or of photos that estimators chose."""

from dav_gswt.field import read_field
from dav_gswt.files import read_json
from dav_gswt.geometry.scene_frame import read_scene_frame
from dav_gswt.images import figures
from dav_gswt.logs import logging_to
from dav_gswt.photos.training_views import read_training_views
from dav_gswt.reconstruction import ground
from dav_gswt_study.seams import summary
from dav_gswt_study.views import evolution

with logging_to(snakemake.log[0]):
    paths, params = snakemake.input, snakemake.params
    key, columns = evolution.psnr_key(read_scene_frame(paths.frame)), []
    notes = [summary.format_seam_note(crops) for crops in paths.get("crops", [])] or [""] * len(paths.fields)
    for title, note, *files in zip(params.titles, notes, paths.fields, paths.grounds, paths.metrics, strict=True):
        fitted, surface, measured = files
        read = read_field(fitted), ground.read_ground(surface), read_json(measured)
        columns.append(evolution.Column(title, *read, note))
    names = list(evolution.choose_test_views(columns[0], key))
    tests = read_training_views(paths.images, paths.model, names, [], params.size)
    strips = evolution.build_strips(columns, tests, key)
    figures.save_figure(evolution.draw_figure(strips, columns, key), snakemake.output.plot)
