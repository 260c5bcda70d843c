"""Sweeps: what one setting changes, and the time of each stage. Not part of `all`: `snakemake sweeps`.

In: the runs of the config's scene for each value of the config's `sweeps`, the other settings as the config has them; what runs
have in common is made once. Out: results/sweeps/{sweep}.csv, results/tables/timing.csv.
"""


rule measure_orders:
    """What tau buys: the error of the orders that a bundle's tiles have, their memory, and the time to compose and sort."""
    input:
        manifest="<results>/<bundle>/davgswt.json",
        parts="<results>/<bundle>/parts",
    output:
        measured="<results>/<bundle>/orders.json",
    log:
        "<logs>/<bundle>/measure_orders.log",
    benchmark:
        "<benchmarks>/<bundle>/measure_orders.tsv"
    threads: 1  # it reports CPU seconds of one core
    resources:
        mem_mb=per_attempt(2500),
        runtime=per_attempt("20m"),
    params:
        source=code_of("measure_orders"),
    script:
        "../scripts/measure_orders.py"


rule gather_sweep:
    """Collect what each value of a setting changes, and what it costs."""
    input:
        measured=lambda wildcards: [path for cell in sweep_cells(wildcards.sweep) for path in cell["files"].values()],
    output:
        table=report("results/sweeps/{sweep}.csv", category="Sweeps", labels={"sweep": "{sweep}"}),
    log:
        "<logs>/sweeps/gather_{sweep}.log",
    benchmark:
        "<benchmarks>/sweeps/gather_{sweep}.tsv"
    wildcard_constraints:
        sweep="|".join(config["sweeps"]) or NEVER,
    params:
        cells=lambda wildcards: sweep_cells(wildcards.sweep),
        source=code_of("gather_sweep"),
    script:
        "../scripts/gather_sweep.py"


rule tabulate_timing:
    """The time of each stage of a run."""
    input:
        measured=lambda wildcards: [path for cell in timed_cells() for path in cell["files"].values()],
    output:
        table=report("results/tables/timing.csv", category="Tables", labels={"table": "timing"}),
    log:
        "<logs>/tables/timing.log",
    benchmark:
        "<benchmarks>/tables/timing.tsv"
    params:
        cells=lambda wildcards: timed_cells(),
        source=code_of("tabulate_timing"),
    script:
        "../scripts/tabulate_timing.py"


rule sweeps:
    """The tables of all sweeps of the config, and the timing table."""
    input:
        expand("results/sweeps/{sweep}.csv", sweep=config["sweeps"]),
        "results/tables/timing.csv",


localrules:
    sweeps,  # makes nothing itself
