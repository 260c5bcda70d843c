"""Rule render_photos: a synthetic scene's photos, cameras and points."""

from pathlib import Path

from dav_gswt.logs import logging_to
from dav_gswt.photos.synthetic import photo_set, scene

with logging_to(snakemake.log[0]):
    entry, folder = snakemake.params.scene, Path(snakemake.output.frame).parent
    photo_set.render_set(entry, folder, scene.start_views(entry), {"hemisphere": scene.test_views(entry)})
