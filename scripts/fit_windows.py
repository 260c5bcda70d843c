"""Rule fit_windows: the windows that tiles and objects are cut from, fitted to the photos that the rounds chose."""

from dataclasses import replace

import numpy as np

from dav_gswt.field import read_field, write_field
from dav_gswt.files import copy_file, write_json
from dav_gswt.geometry.scene_frame import read_scene_frame
from dav_gswt.logs import logging_to
from dav_gswt.materials import build, windows
from dav_gswt.materials.maps import measure_ground, sharpen_maps
from dav_gswt.photos.training_views import read_training_views
from dav_gswt.photos.view_split import read_view_split
from dav_gswt.reconstruction import ground, observation
from dav_gswt.reconstruction.fitting.plan import FitSettings
from dav_gswt.reconstruction.windows import Draft, fit_windows, join_windows, widen_exemplar

with logging_to(snakemake.log[0]):
    paths, params = snakemake.input, snakemake.params
    names, size = list(read_view_split(paths.views).start), params.preset["fit_size"]
    photos = read_training_views(paths.images, paths.model, names, list(paths.captures), size, params.keep)
    draft = Draft(read_field(paths.draft), ground.read_ground(paths.draft_ground), read_scene_frame(paths.frame))
    masks = {name.removeprefix("mask_"): path for name, path in paths.items() if name.startswith("mask_")}
    settings = FitSettings.from_preset(params.preset).from_scratch(len(names), len(photos))
    photos, _ = observation.observe(draft.frame, draft.grid, photos)
    whole = widen_exemplar(draft.grid, draft.frame.exemplar)
    maps = sharpen_maps(measure_ground(draft.field, whole), photos)
    plan = build.plan_ground(maps, bool(draft.field.ground.any()), masks)
    focus, rng = windows.choose_windows(plan, photos, settings), np.random.default_rng([params.seed, params.t])
    pairs = fit_windows(draft, photos, focus.windows, focus.spacing, settings, rng)
    focus, fitted = replace(focus, windows=[window for window, _ in pairs]), [each for _, each in pairs]
    joined, parts = join_windows(draft, fitted), [(each.field, each.grid) for each in fitted]
    maps = windows.map_windows(maps, parts)
    windows.write_windows(parts, focus, maps, snakemake.output.windows)
    write_field(joined, snakemake.output.field)
    copy_file(paths.draft_ground, snakemake.output.ground)
    reports = [vars(each.report) for each in fitted]
    write_json(snakemake.output.fit, {key: sum(report[key] for report in reports) for key in reports[0]})
