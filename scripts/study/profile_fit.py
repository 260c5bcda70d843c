"""Rule profile_fit: quality of a fit over time, and stills of its field away from the photos."""

from pathlib import Path

from dav_gswt.files import write_json
from dav_gswt.images import image_files
from dav_gswt.logs import logging_to
from dav_gswt.provenance import record_provenance
from dav_gswt.reconstruction.fit_settings import FitSettings
from dav_gswt.study import csv_tables, fit_profile

with logging_to(snakemake.log[0]):
    out, settings = snakemake.output, dict(snakemake.params.profile)
    margin = settings.pop("margin")
    quality = FitSettings(**settings)
    photos = fit_profile.opened(Path(snakemake.input.frame).parent, quality.size, margin)
    found = fit_profile.run(photos, quality)
    csv_tables.write_table(out.curve, found.curve)
    for name, picture in fit_profile.stills(found.made, photos.frame).items():
        image_files.write_png(out[name], picture)
    inputs = {"frame": snakemake.input.frame}
    write_json(out.facts, fit_profile.facts(found, photos) | {"provenance": record_provenance(inputs, settings)})
