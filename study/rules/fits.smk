"""Rounds against one fit to the same photos.

In: the photos of the scenes of the config's `study.refits`. Out: study/docs/data/refits_{scene}.csv. `snakemake refits`.
"""


rule compare_refits:
    """Fit photos in rounds of several sizes, and at once."""
    input:
        unpack(lpips_weights),
        views=lambda wildcards: first_start(wildcards, "refits"),
        frame="<results>/<photos>/ground.json",
        images="<results>/<photos>/images",
        model="<results>/<photos>/sparse",
    output:
        table="study/docs/data/refits_{scene}.csv",
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
        source=code_of_study("compare_refits"),
    script:
        "../scripts/compare_refits.py"


rule refits:
    """Compare rounds with one fit, on every scene of the config's `study.refits`."""
    input:
        expand("study/docs/data/refits_{scene}.csv", scene=STUDY["refits"]),


localrules:
    refits,
