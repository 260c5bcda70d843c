"""Rule evaluate_inpainted: metrics of the test photos before and after inpainting."""

from dav_gswt.field import read_field
from dav_gswt.files import write_json
from dav_gswt.images import lpips_weights
from dav_gswt.inpainting import build
from dav_gswt.logs import logging_to
from dav_gswt.photos.training_views import read_training_views
from dav_gswt.photos.view_split import read_view_split
from dav_gswt.provenance import record_provenance
from dav_gswt.reconstruction import ground
from dav_gswt.reconstruction.observation import mask_to_ground

with logging_to(snakemake.log[0]):
    paths, preset = snakemake.input, snakemake.params.preset
    names, grid = read_view_split(paths.views).test, ground.read_ground(paths.ground)
    tests = mask_to_ground(read_training_views(paths.images, paths.model, names, [], preset["size"]), grid)
    perceptual = lpips_weights.read(paths.lpips) if paths.get("lpips") else None
    result = build.evaluate_inpainting(read_field(paths.before), read_field(paths.after), tests, perceptual)
    inputs = {name: paths[name] for name in ("before", "after", "ground", "views")}
    write_json(snakemake.output.metrics, result | {"provenance": record_provenance(inputs, dict(preset))})
