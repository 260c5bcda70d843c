"""Seams: can anybody find the borders and the cuts? `snakemake seams`.

In: levels and tiles. Out, per experiment (a scene, a seed, a tiling): crops.csv, facts.json. Gathered:
study/results/tables/seams.csv (every crop); in study/docs/data seam_summary.csv and seam_ablation.csv, where runs add up; the
page study/docs/results/seams.md.
"""


rule measure_seams:
    """Crops on borders and cuts of each material, beside the same of uncut patches and of tiles cut straight."""
    input:
        unpack(lambda wildcards: lpips_weights()),
        levels="<results>/<levels>",
        seams="<results>/<tiles>/seams.json",
        tiles="<results>/<tiles>/tiles",
    output:
        crops="<results>/<seams>/crops.csv",
        facts="<results>/<seams>/facts.json",
    log:
        "<logs>/<seams>/measure_seams.log",
    priority: -1  # after all jobs of two threads: between them one core would stand idle
    threads: 1  # crops are small: two cells beside each other take half the time
    resources:
        mem_mb=per_attempt(4000),
        runtime=per_attempt("20m"),
    params:
        tiling=lambda wildcards: config["tilings"][plain_tiling(wildcards)],
        seed=integer("seed"),
        tau=real("tau"),
        source=code_of_study("measure_seams"),
    script:
        "../scripts/measure_seams.py"


rule gather_seams:
    """Every crop of every cell in one table; what follows from them, added to what earlier runs found; the page and its figure."""
    input:
        measured=lambda wildcards: [cell[name] for cell in seam_experiments() for name in ("table", "facts")],
        template=str(HERE / "report/seams.md"),
    output:
        crops="study/results/tables/seams.csv",
        kept=update(expand("study/docs/data/{table}.csv", table=["seam_summary", "seam_ablation"])),
        plot="study/docs/figures/seam_ablation.png",
        page="study/docs/results/seams.md",
    log:
        "<logs>/seams/gather_seams.log",
    params:
        cells=lambda wildcards: seam_experiments(),
        study=lambda wildcards: STUDY["seams"],
        own=lambda wildcards: {scene: config["scenes"][scene]["tiling"] for scene in STUDY["seams"]["scenes"]},
        source=code_of_study("gather_seams"),
    script:
        "../scripts/gather_seams.py"


rule plot_cuts:
    """Cuts by colour alone beside those by what the ground is, drawn into the same tiles."""
    input:
        seams=[f"<results>/<round>{{inpainted}}/tiles_{kind}/seams.json" for kind in ("colour", "semantic")],
        tiles=[f"<results>/<round>{{inpainted}}/tiles_{kind}/tiles" for kind in ("colour", "semantic")],
        levels="<results>/<levels>",
    output:
        plot="<results>/<round>{inpainted}/seam_cuts.png",
    log:
        "<logs>/<round>{inpainted}/plot_cuts.log",
    params:
        source=code_of_study("plot_cuts"),
    script:
        "../scripts/plot_cuts.py"


rule seams:
    """Measure the seams of the config's `study.seams`, and draw cuts."""
    input:
        rules.gather_seams.output,
        lambda wildcards: [
            path
            for scene in STUDY["seams"]["scenes"]
            for path in expand(list(rules.plot_cuts.output), **seam_branch(scene))
        ],


localrules:
    seams,
