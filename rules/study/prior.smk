"""TODO."""


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
        source=code_of("train_prior"),


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
        lpips=lambda wildcards: [f for f in rules.fetch_lpips.output if Path(f).exists()],
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
        mem_mb=growing(4000),
        runtime=growing("2h"),
    params:
        setting=TRIAL,
        views=320,  # of those held out, evenly
        shown=8,
        source=code_of("study/evaluate_prior"),
    script:
        "../../scripts/study/evaluate_prior.py"
