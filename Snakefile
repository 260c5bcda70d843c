"""DAV-GSWT: a few photos of a patch of ground to Gaussian-splat Wang tiles and an endless terrain.

    photos -> coarse -> active (round 1..T) -> levels -> tiles -> bundle -> terrain

Each stage is one file in rules/, one subpackage of workflow/lib/dav_gswt and one directory level of results/.
"""

from snakemake.utils import min_version

min_version("9.13")  # the release that brought pathvars


configfile: "config/config.yaml"


report: "workflow/report/workflow.rst"


onstart:
    # The limit of 100 jobs a second, which holds where none is given, makes the scheduler look for jobs once a second
    # more after each job that is done: after 200 jobs that takes a fifth of a core. One that is given stays.
    limiter = getattr(workflow.scheduler, "job_rate_limiter", None)
    if limiter and (limiter.max_jobs, limiter.timespan) == (100, 1):
        workflow.scheduler.job_rate_limiter = None


include: "rules/common.smk"
include: "rules/cells.smk"
include: "rules/shown.smk"
include: "rules/photos.smk"
include: "rules/coarse.smk"
include: "rules/prior.smk"
include: "rules/active.smk"
include: "rules/benchmark.smk"
include: "rules/views.smk"
include: "rules/completion.smk"
include: "rules/levels.smk"
include: "rules/tiles.smk"
include: "rules/bundle.smk"
include: "rules/terrain.smk"
include: "rules/seams.smk"
include: "rules/perceptual.smk"
include: "rules/figures.smk"
include: "rules/inspection.smk"
include: "rules/sweeps.smk"
include: "rules/tables.smk"
include: "rules/frames.smk"
include: "rules/stability.smk"
include: "rules/tradeoff.smk"
include: "rules/study.smk"


# Below the includes: Snakemake skips constraints on wildcards that reach an output through a pathvar unless they are
# declared after the rules.
wildcard_constraints:
    scene=NAME,
    seed=NATURAL,
    quality=NAME,
    policy=POLICY,
    prior=PRIOR,
    p_drop=SHARE,
    lam=NUMBER,
    k=NATURAL,
    stop=STOP,
    t=NATURAL,
    painter=PAINTER,
    completed=COMPLETED,
    seam=NAME,
    tau=FRACTION,
    sweep=NAME,
    kind="spz|sog",
    size=POSITIVE,


rule all:
    default_target: True
    input:
        terrain_of(config["scene"]),
        study_of(config["scene"]),
