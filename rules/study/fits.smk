"""Fit profiles: PSNR of the test photos over the seconds of a fit, and what its field looks like from elsewhere.

In: the photos of a scene of the config's `study.fit_profiles`. Out: docs/research/data/fit_{scene}.csv and figures.
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
