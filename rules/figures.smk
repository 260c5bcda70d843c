"""Figures of docs/: how soon a fit shows photos it has not seen, what its field looks like from elsewhere, and whether
scores of poses say where a field is wrong.

In: the photos of a scene; calibration.json of scenes and rounds. Out: tables in docs/data with their provenance, plots.
Not part of `all`: `snakemake docs/figures/fit_time.png docs/figures/calibration.png` makes them. Seconds differ from
machine to machine.
"""

CURVES = ["copr_dunes", "desert_high"]  # one real set, one synthetic


rule watch_fit:
    """Fit a scene while looking at its test photos."""
    input:
        frame="<results>/<photos>/ground.json",
        images="<results>/<photos>/images",
        model="<results>/<photos>/sparse",
    output:
        curve="docs/data/fit_{scene}.csv",
        facts="docs/data/fit_{scene}.json",
        oblique="docs/figures/{scene}_oblique.png",
        low="docs/figures/{scene}_low.png",
    log:
        "<logs>/figures/watch_fit_{scene}.log",
    benchmark:
        "<benchmarks>/figures/watch_fit_{scene}.tsv"
    threads: 2
    resources:
        mem_mb=growing(3000),
        runtime=growing("30m"),
    params:
        trial=lambda wildcards: lookup(dpath=f"trials/{wildcards.scene}", within=config),
        source=source_of("coarse", "fitting", "raster"),
    script:
        "../scripts/watch_fit.py"


rule plot_fits:
    """PSNR of test photos against seconds."""
    input:
        curves=expand("docs/data/fit_{scene}.csv", scene=CURVES),
    output:
        plot="docs/figures/fit_time.png",
    log:
        "<logs>/figures/plot_fits.log",
    benchmark:
        "<benchmarks>/figures/plot_fits.tsv"
    params:
        source=source_of("figures"),
    script:
        "../scripts/plot_fits.py"


rule plot_calibration:
    """Do scores say where a field is wrong? All scenes and rounds in one table and one figure."""
    input:
        cells=lambda wildcards: list(calibrations()),
    output:
        table="docs/data/calibration.csv",
        facts="docs/data/calibration.json",
        plot="docs/figures/calibration.png",
    log:
        "<logs>/figures/plot_calibration.log",
    benchmark:
        "<benchmarks>/figures/plot_calibration.tsv"
    params:
        cells=lambda wildcards: list(calibrations().values()),
        source=source_of("active/calibration/report", "figures"),
    script:
        "../scripts/plot_calibration.py"
