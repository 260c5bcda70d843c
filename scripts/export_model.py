"""Rule export_model: the photos of a round as a model for other programs."""

from dav_gswt.export import photo_model
from dav_gswt.logs import logging_to
from dav_gswt.photos.capture_record import list_taken_photos
from dav_gswt.photos.colmap_model import read_colmap_model
from dav_gswt.photos.view_split import read_view_split

with logging_to(snakemake.log[0]):
    paths = snakemake.input
    known, split = read_colmap_model(paths.model), read_view_split(paths.views)
    taken = list_taken_photos(paths.images, known, split.start, list(paths.captures))
    photo_model.write_photo_models(snakemake.output.model, paths.images, known, split, taken)
