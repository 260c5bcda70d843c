"""Rule compare_refits: photos taken in rounds against one fit to all of them."""

from pathlib import Path

from dav_gswt.images import lpips_weights
from dav_gswt.logs import logging_to
from dav_gswt.photos.view_split import read_view_split
from dav_gswt.reconstruction import ground
from dav_gswt.reconstruction.fitting.plan import FitSettings
from dav_gswt.study import csv_tables, refits

with logging_to(snakemake.log[0]):
    paths, asked = snakemake.input, snakemake.params.refits
    split = read_view_split(paths.views)
    weights = lpips_weights.read(paths.lpips) if paths.get("lpips") else None
    margin = ground.WHOLE if snakemake.params.whole else ground.MARGIN
    coarse = update = FitSettings.from_preset(asked)
    settings = refits.RefitSettings(coarse, update, len(split.start), weights)
    photos = refits.read_refit_photos(Path(paths.frame).parent, split, asked["photos"], coarse.size, margin)
    rows = refits.compare_refits(photos, settings, asked["photos_a_round"], asked["first_rates"], asked["seeds"])
    csv_tables.write_table(snakemake.output.table, rows)
