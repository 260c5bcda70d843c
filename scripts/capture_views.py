"""Rule capture_views: the photos of this round."""

from pathlib import Path

from dav_gswt.active import agents
from dav_gswt.files import read_json
from dav_gswt.logs import logging_to

with logging_to(snakemake.log[0]):
    given = snakemake.input
    agents.capture(
        snakemake.params.scene,
        read_json(given.frame),
        read_json(given.views),
        Path(given.images).parent,
        list(given.captures) if not isinstance(given.captures, str) else [given.captures],
        read_json(given.poses)["poses"],
        Path(snakemake.output.capture),
    )
