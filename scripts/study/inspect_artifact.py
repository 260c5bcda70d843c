"""Rule inspect_artefact: what does an artefact look like?"""

from pathlib import Path

from dav_gswt.inspect import command, kinds, saving
from dav_gswt.inspect.options import Asked
from dav_gswt.logs import logging_to

SIZE = (960, 600)

with logging_to(snakemake.log[0]):
    command.require()
    saving.prepare()
    scene = kinds.scene_of(Path(snakemake.input[0]), Asked(**snakemake.params.asked))
    saving.save(scene, Path(snakemake.output.picture), SIZE)
