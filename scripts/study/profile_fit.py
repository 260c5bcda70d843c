"""Rule profile_fit: quality of a fit over time, and stills of its field away from the photos."""

from dataclasses import replace
from pathlib import Path

from dav_gswt.files import write_json
from dav_gswt.images import image_files
from dav_gswt.logs import logging_to
from dav_gswt.provenance import record_provenance
from dav_gswt.reconstruction.fit_settings import CoarseSettings, select_settings
from dav_gswt.study import csv_tables, fit_profile

with logging_to(snakemake.log[0]):
    out, settings = snakemake.output, dict(snakemake.params.profile)
    margin = settings.pop("margin")
    preset = replace(select_settings(CoarseSettings, settings), steps_per_photo=0)  # `steps` are of the whole fit
    photos = fit_profile.read_photo_set(Path(snakemake.input.frame).parent, preset.size, margin)
    found = fit_profile.profile_fit(photos, preset)
    csv_tables.write_table(out.curve, found.curve)
    for name, picture in fit_profile.render_stills(found.made, photos.frame).items():
        image_files.write_png(out[name], picture)
    inputs = {"frame": snakemake.input.frame}
    write_json(
        out.facts, fit_profile.describe_trial(found, photos) | {"provenance": record_provenance(inputs, settings)}
    )
