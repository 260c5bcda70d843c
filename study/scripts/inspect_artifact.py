"""Rule inspect_artifact: what does an artefact look like?"""

from pathlib import Path

from dav_gswt.inspect import command
from dav_gswt.logs import logging_to

with logging_to(snakemake.log[0]):
    command.require_extra()
    from dav_gswt.inspect import plot, readers  # here, not above: they need the extra

    plot.require_rendering()
    scene = readers.read_scene(Path(snakemake.input[0]), most=command.MAX_DRAWN, **snakemake.params.asked)
    plot.show(scene, (960, 600), Path(snakemake.output.picture))
