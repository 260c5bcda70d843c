"""Rule draw_rover: what docs/terrain-api.md tells people to type for examples/rover."""

import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

from dav_gswt.cli import main
from dav_gswt.files import atomic_file
from dav_gswt.logs import logging_to

with logging_to(snakemake.log[0]), TemporaryDirectory() as place, atomic_file(snakemake.output.picture) as part:
    exports, drawn = Path(place, "exports"), Path(place, "rover.webp")
    if main.main(["export", str(snakemake.input.page), *snakemake.params.export, "-o", str(exports)]):
        raise SystemExit(1)
    seconds = str(snakemake.params.seconds)
    command = [sys.executable, snakemake.input.example, exports, drawn, "--seconds", seconds]
    subprocess.run([str(word) for word in command], check=True)
    part.write_bytes(drawn.read_bytes())
