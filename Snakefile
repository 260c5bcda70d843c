"""DAV-GSWT: a few photos of a patch of ground to Gaussian-splat Wang tiles and an endless terrain.

    photos -> reconstruction -> views and capture (round 1..T) -> lod -> tiles -> bundle -> terrain

Each stage is one file in rules/, packages of workflow/lib/dav_gswt and one directory level of results/ (docs/architecture.md).
"""

from snakemake.utils import min_version

min_version("9.13")  # the release that brought pathvars


# not workflow.basedir: another workflow may include this one
configfile: f"{workflow.current_basedir}/config/config.yaml"


report: "workflow/report/workflow.rst"


onstart:
    lift_job_rate_limit(workflow.scheduler)


include: "rules/paths.smk"
include: "rules/inputs.smk"
include: "rules/photos.smk"
include: "rules/reconstruction.smk"
include: "rules/views.smk"
include: "rules/capture.smk"
include: "rules/inpainting.smk"
include: "rules/materials.smk"
include: "rules/lod.smk"
include: "rules/tiles.smk"
include: "rules/bundle.smk"
include: "rules/terrain.smk"
include: "rules/export.smk"
include: "rules/sweeps.smk"


# Below the includes: Snakemake skips constraints on wildcards that reach an output through a pathvar unless they are
# declared after the rules.
wildcard_constraints:
    **constraints(config),


rule all:
    default_target: True
    input:
        terrain_targets(config["scene"]),
        photo_targets(config["scene"]),
