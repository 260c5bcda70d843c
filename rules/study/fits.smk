"""Figures of docs/: how soon a fit shows photos it has not seen, what its field looks like from elsewhere, and whether
scores of poses say where a field is wrong.

In: the photos of a scene; calibration.json of scenes and rounds. Out: tables in docs/research/data with their provenance, plots.
Not part of `all`: `snakemake docs/research/figures/fit_time.png docs/research/figures/calibration.png` makes them. Seconds differ from
machine to machine.
"""


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
        mem_mb=growing(3000),
        runtime=growing("30m"),
    params:
        trial=lambda wildcards: lookup(dpath=f"trials/{wildcards.scene}", within=config),
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
