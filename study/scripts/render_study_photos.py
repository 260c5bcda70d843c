"""Rule render_study_photos: the photos of a synthetic scene from where the study takes and tests them."""

from pathlib import Path

from dav_gswt.logs import logging_to
from dav_gswt.photos.synthetic import photo_set
from dav_gswt_study.synthetic_views import place_start_views, place_test_views

with logging_to(snakemake.log[0]):
    entry, asked = snakemake.params.scene, snakemake.params.photographed
    groups = place_test_views(entry, asked["layout"], asked["oblique"], asked["walkers"])
    folder = Path(snakemake.output.frame).parent
    photo_set.render_set(entry, folder, place_start_views(entry, asked["layout"]), groups)
