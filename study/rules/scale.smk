"""How costs grow: fits over photos and pixels, renders over Gaussians, scores over candidates, views over tiles.

In: the first field of the scene of the config's `study.scale`. Out: study/results/scale/{kind}_{size}.json, each by a process
of its own on an otherwise idle machine; study/docs/data/scale.csv, study/results/scale.md, figures/scale.png.
"""


rule render_scale_photos:
    """Photos of a field, in any number and size."""
    input:
        unpack(scale_field),
    output:
        images=directory("study/results/scale/photos/{amount}x{pixels}"),
    log:
        "<logs>/scale/render_photos_{amount}x{pixels}.log",
    benchmark:
        "<benchmarks>/scale/render_photos_{amount}x{pixels}.tsv"
    wildcard_constraints:
        amount=POSITIVE,
        pixels=POSITIVE,
    threads: 2
    resources:
        mem_mb=per_attempt(3000),
        runtime=per_attempt("60m"),
    params:
        source=code_of_study("render_scale_photos"),
    script:
        "../scripts/render_scale_photos.py"


rule measure_scale:
    """Seconds and memory of one fit, render, scoring or view."""
    input:
        unpack(scale_field),
        images=lambda wildcards: expand(
            "study/results/scale/photos/{cell[0]}x{cell[1]}",
            cell=[found] if (found := scale_photos(wildcards.what, int(wildcards.amount))) else [],
        ),
    output:
        cost="study/results/scale/{what}_{amount}.json",
    log:
        "<logs>/scale/{what}_{amount}.log",
    benchmark:
        "<benchmarks>/scale/{what}_{amount}.tsv"
    wildcard_constraints:
        what="photos|pixels|limits|gaussians|candidates|tiles|threads",
        amount=POSITIVE,
    threads: 2
    resources:
        mem_mb=per_attempt(8000),
        runtime=per_attempt("120m"),
    params:
        photos=lambda wildcards: scale_photos(wildcards.what, int(wildcards.amount)),
        preset=lambda wildcards: config["presets"][STUDY["scale"]["preset"]],
        changed=lambda wildcards: changed_preset(wildcards.what, int(wildcards.amount)),
        keep=SNAPSHOTS,
        source=code_of_study("measure_scale"),
    script:
        "../scripts/measure_scale.py"


rule gather_scale:
    """The curves of all cells, their exponents and a figure."""
    input:
        template=str(HERE / "report/scale.md"),
        cells=[f"study/results/scale/{what}_{amount}.json" for what, amount in scale_cells()],
    output:
        table="study/docs/data/scale.csv",
        page="study/docs/results/scale.md",
        plot="study/docs/figures/scale.png",
    log:
        "<logs>/scale/gather.log",
    benchmark:
        "<benchmarks>/scale/gather.tsv"
    params:
        asked=STUDY["scale"],
        preset=lambda wildcards: config["presets"][STUDY["scale"]["preset"]],
        source=code_of_study("gather_scale"),
    script:
        "../scripts/gather_scale.py"


rule scale:
    """How costs grow with photos, pixels, Gaussians, candidates and tiles."""
    input:
        rules.gather_scale.output,


localrules:
    scale,
