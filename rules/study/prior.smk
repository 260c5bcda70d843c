"""The prior on worlds that it was not trained on, and a deterministic network of its shape as a control.

In: examples of held-out worlds. Out: results/prior/regressor{member}.safetensors; docs/research/data/prior_trial.csv and
figures/prior_*.png.
"""

# Nothing random to learn: it is done sooner. The first is compared with the prior; the second only shows how far two such
# networks lie apart.
REGRESSORS = [dict(steps=steps, batch=24, rate=6e-4, seed=100 + i) for i, steps in enumerate((4000, 2000))]
MEMBERS = len(REGRESSORS)
HELD_OUT = range(40, 44)  # parts of worlds that nothing was trained on
TRIAL = dict(m=5, p_drop=0.15, steps=8, seed=0)  # as the config asks the prior


rule train_regressor:
    """Train a deterministic network of the prior's shape on the same examples."""
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
    threads: 2
    resources:
        mem_mb=per_attempt(4000),
        runtime=per_attempt("4h"),
    params:
        coder=CODER,
        denoiser=lambda wildcards: REGRESSORS[int(wildcards.member)],
        keep=lambda wildcards: f"{SNAPSHOTS}/prior/regressor{wildcards.member}",
        source=code_of("train_prior"),
    script:
        "../../scripts/train_prior.py"


rule evaluate_prior:
    """How near the prior comes to the truth, and what its doubt is worth, on worlds that it was not trained on.

    Columns on LPIPS are empty where its weights were not fetched.
    """
    input:
        weights="<results>/prior/terrain.safetensors",
        regressors=expand("<results>/prior/regressor{member}.safetensors", member=range(MEMBERS)),
        losses=["<results>/prior/terrain_losses.csv"]
        + expand("<results>/prior/regressor{member}_losses.csv", member=range(MEMBERS)),
        examples=expand("<results>/prior/examples/part{part}.npz", part=HELD_OUT),
        lpips=lambda wildcards: list(lpips_weights(wildcards).values()),
    output:
        table="docs/research/data/prior_trial.csv",
        losses="docs/research/figures/prior_losses.png",
        samples="docs/research/figures/prior_samples.png",
    log:
        "<logs>/prior/evaluate_prior.log",
    benchmark:
        "<benchmarks>/prior/evaluate_prior.tsv"
    threads: 2
    resources:
        mem_mb=per_attempt(4000),
        runtime=per_attempt("2h"),
    params:
        setting=TRIAL,
        views=320,  # of those held out, evenly
        shown=8,
        source=code_of("study/evaluate_prior"),
    script:
        "../../scripts/study/evaluate_prior.py"
