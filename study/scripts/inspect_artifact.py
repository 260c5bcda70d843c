"""Rule inspect_artifact: what does an artefact look like?"""

from pathlib import Path

from dav_gswt.inspect import artifacts, command, saving
from dav_gswt.inspect.options import ViewOptions
from dav_gswt.logs import logging_to

SIZE = (960, 600)

with logging_to(snakemake.log[0]):
    command.require_extra()
    saving.prepare_rendering()
    scene = artifacts.build_scene(Path(snakemake.input[0]), ViewOptions(**snakemake.params.asked))
    saving.save_scene(scene, Path(snakemake.output.picture), SIZE)
