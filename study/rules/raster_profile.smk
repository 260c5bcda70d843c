"""Where the rasterizer's time goes, and how near it comes to what the processor can do: `snakemake raster_profile`.

In: the field of the config's `study.scale`. Out: study/docs/data/rasterizer.csv, study/results/rasterizer.md,
figures/rasterizer.png. Needs the C++ core and an otherwise idle machine.
"""


rule profile_rasterizer:
    """Milliseconds of each stage by instruction set and threads."""
    input:
        unpack(scale_field),
        template=str(HERE / "report/rasterizer.md"),
    output:
        table="study/docs/data/rasterizer.csv",
        page="study/docs/results/rasterizer.md",
        plot="study/docs/figures/rasterizer.png",
    log:
        "<logs>/scale/profile_rasterizer.log",
    benchmark:
        "<benchmarks>/scale/profile_rasterizer.tsv"
    threads: 2
    resources:
        mem_mb=per_attempt(2000),
        runtime=per_attempt("10m"),
    params:
        size=STUDY["scale"]["size"],
        source=code_of_study("profile_rasterizer"),
    script:
        "../scripts/profile_rasterizer.py"


rule raster_profile:
    """Where the rasterizer's time goes."""
    input:
        rules.profile_rasterizer.output,


localrules:
    raster_profile,
