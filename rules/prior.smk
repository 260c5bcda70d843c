"""Weights: of LPIPS, which come with the set-up, and the training of the project's own prior.

In: nothing of a scene. Out: weights/lpips_alexnet.safetensors; prior/examples/part{part}.npz, what the prior learns from: part p
holds views of the synthetic worlds 20 p to 20 p + 19; prior/terrain.safetensors, its weights. `make prior` trains it: hours.
"""

WORLDS_A_PART, VIEWS_A_WORLD = 20, 16
PARTS = 32  # of examples that the prior is trained on; later ones are for evaluation
CODER = dict(steps=6000, batch=16, rate=2e-3, seed=0)
DENOISER = dict(steps=8000, batch=24, rate=6e-4, seed=1)


rule convert_lpips_weights:
    """Check the published weights of LPIPS on AlexNet (BSD) by their digest, and keep them as safetensors."""
    input:
        lambda wildcards: locate_weights(config["lpips"]),
    output:
        weights=paths.LPIPS_WEIGHTS,
    log:
        "<logs>/weights/convert_lpips_weights.log",
    benchmark:
        "<benchmarks>/weights/convert_lpips_weights.tsv"
    params:
        source=code_of("convert_lpips_weights"),
    script:
        "../scripts/convert_lpips_weights.py"


rule make_examples:
    """Views of procedural worlds: the truth, and what fields fitted from few photos show of it."""
    output:
        examples="<results>/prior/examples/part{part}.npz",
    log:
        "<logs>/prior/examples/part{part}.log",
    benchmark:
        "<benchmarks>/prior/examples/part{part}.tsv"
    wildcard_constraints:
        part=NATURAL,
    resources:
        mem_mb=per_attempt(600),
        runtime=per_attempt("10m"),
    params:
        seeds=lambda wildcards: [int(wildcards.part) * WORLDS_A_PART + i for i in range(WORLDS_A_PART)],
        views=VIEWS_A_WORLD,
        source=code_of("make_examples"),
    script:
        "../scripts/make_examples.py"


rule train_prior:
    """Train the project's own prior on all examples; an interrupted training resumes at its last checkpoint."""
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
        mem_mb=per_attempt(4000),
        runtime=per_attempt("4h"),
    params:
        coder=CODER,
        denoiser=DENOISER,
        keep=f"{SNAPSHOTS}/prior/terrain",
        source=code_of("train_prior"),
    script:
        "../scripts/train_prior.py"


localrules:
    convert_lpips_weights,  # seconds
