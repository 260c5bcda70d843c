"""Rule draw_exits: what do other programs draw of each export?"""

from pathlib import Path
from tempfile import TemporaryDirectory

from fixtures import exits

from dav_gswt.cli import main
from dav_gswt.logs import logging_to

NAMES = "spz", "ply", "sog", "glb", "3dtiles", "ground"
FORMATS = [word for name in NAMES for word in ("--format", name)]

with logging_to(snakemake.log[0]), TemporaryDirectory() as place:
    page = Path(str(snakemake.input.page))
    if main.main(["export", str(page), "--columns", "4", "--rows", "4", "--level", "1", *FORMATS, "-o", place]):
        raise SystemExit(1)
    exits.draw_exits(snakemake.input.server, page, Path(place), [Path(path) for path in snakemake.output.pictures])
