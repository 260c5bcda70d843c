"""Fits by themselves: their quality over seconds, and rounds against one fit to the same photos.

In: the photos of the scenes of the config's `study.fit_profiles` and `study.refits`. Out: docs/research/data/fit_{scene}.csv
and figures, docs/research/data/refits_{scene}.csv.
"""

CURVES = ["copr_dunes", "desert_high"]  # one real set, one synthetic


rule profile_fit:
    """Fit a scene while looking at its test photos."""
    input:
        frame="<results>/<photos>/ground.json",
        images="<results>/<photos>/images",
        model="<results>/<photos>/sparse",
    output:
        curve="docs/research/data/fit_{scene}.csv",
        facts="docs/research/data/fit_{scene}.json",
        oblique="docs/research/figures/{scene}_oblique.png",
        low="docs/research/figures/{scene}_low.png",
    log:
        "<logs>/figures/profile_fit_{scene}.log",
    benchmark:
        "<benchmarks>/figures/profile_fit_{scene}.tsv"
    threads: 2
    resources:
        mem_mb=per_attempt(3000),
        runtime=per_attempt("30m"),
    params:
        profile=lambda wildcards: STUDY["fit_profiles"][wildcards.scene],
        source=code_of("study/profile_fit"),
    script:
        "../../scripts/study/profile_fit.py"


rule plot_fits:
    """PSNR of test photos against seconds."""
    input:
        curves=expand("docs/research/data/fit_{scene}.csv", scene=CURVES),
    output:
        plot="docs/research/figures/fit_time.png",
    log:
        "<logs>/figures/plot_fits.log",
    benchmark:
        "<benchmarks>/figures/plot_fits.tsv"
    params:
        source=code_of("study/plot_fits"),
    script:
        "../../scripts/study/plot_fits.py"


rule compare_refits:
    """Fit photos in rounds of several sizes, and at once."""
    input:
        unpack(lpips_weights),
        views=lambda wildcards: first_start(wildcards, "refits"),
        frame="<results>/<photos>/ground.json",
        images="<results>/<photos>/images",
        model="<results>/<photos>/sparse",
    output:
        table="docs/research/data/refits_{scene}.csv",
    log:
        "<logs>/figures/compare_refits_{scene}.log",
    benchmark:
        "<benchmarks>/figures/compare_refits_{scene}.tsv"
    wildcard_constraints:
        scene="|".join(STUDY["refits"]) or NEVER,
    threads: 2
    resources:
        mem_mb=per_attempt(3000),
        runtime=per_attempt("60m"),
    params:
        refits=lambda wildcards: STUDY["refits"][wildcards.scene],
        whole=lambda wildcards: config["scenes"][wildcards.scene].get("whole", False),
        source=code_of("study/compare_refits"),
    script:
        "../../scripts/study/compare_refits.py"


rule refits:
    """Compare rounds with one fit, on every scene of the config's `study.refits`."""
    input:
        expand("docs/research/data/refits_{scene}.csv", scene=STUDY["refits"]),


localrules:
    refits,
