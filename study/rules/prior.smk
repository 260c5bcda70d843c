"""Training of the project's own prior.

In: nothing of a scene. Out: study/results/prior/examples/part{part}.npz, what it learns from (part p holds views of the synthetic worlds 20 p to
20 p + 19); study/results/prior/terrain.safetensors, its weights, which `make prior` trains: hours.
"""

WORLDS_A_PART, VIEWS_A_WORLD = 20, 16
PARTS = 32  # of examples that the prior is trained on
CODER = dict(steps=6000, batch=16, rate=2e-3, seed=0)
DENOISER = dict(steps=8000, batch=24, rate=6e-4, seed=1)


rule make_examples:
    """Views of procedural worlds: the truth, and what fields fitted from few photos show of it."""
    output:
        examples="study/results/prior/examples/part{part}.npz",
    log:
        "<logs>/prior/examples/part{part}.log",
    wildcard_constraints:
        part=NATURAL,
    resources:
        mem_mb=per_attempt(600),
        runtime=per_attempt("10m"),
    params:
        seeds=lambda wildcards: [int(wildcards.part) * WORLDS_A_PART + i for i in range(WORLDS_A_PART)],
        views=VIEWS_A_WORLD,
        source=code_of_study("make_examples"),
    script:
        "../scripts/make_examples.py"


rule train_prior:
    """Train the project's own prior on all examples; an interrupted training resumes at its last checkpoint."""
    input:
        examples=expand("study/results/prior/examples/part{part}.npz", part=range(PARTS)),
    output:
        weights="study/results/prior/terrain.safetensors",
        losses="study/results/prior/terrain_losses.csv",
    log:
        "<logs>/prior/train_prior.log",
    threads: 2
    resources:
        mem_mb=per_attempt(4000),
        runtime=per_attempt("4h"),
    params:
        coder=CODER,
        denoiser=DENOISER,
        keep=f"{SNAPSHOTS}/prior/terrain",
        source=code_of_study("train_prior"),
    script:
        "../scripts/train_prior.py"
