"""Rule watch_fit: a fit, watched second by second, and stills of its field that nobody photographed."""

from pathlib import Path

from dav_gswt import figures, images, provenance
from dav_gswt.coarse import build, trial
from dav_gswt.files import write_json
from dav_gswt.logs import logging_to

with logging_to(snakemake.log[0]):
    out, settings = snakemake.output, dict(snakemake.params.trial)
    margin = settings.pop("margin")
    quality = build.Quality(**settings)
    photos = trial.opened(Path(snakemake.input.frame).parent, quality.size, margin)
    found = trial.run(photos, quality)
    figures.write_rows(out.curve, found.curve)
    for name, picture in trial.stills(found.made, photos.frame).items():
        images.write(out[name], picture)
    inputs = {"frame": snakemake.input.frame}
    write_json(out.facts, trial.facts(found, photos) | {"provenance": provenance.of(inputs, settings)})
