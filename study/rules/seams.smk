"""Seams: can anybody find the borders and the cuts, and does the terrain repeat? `snakemake seams`.

In: levels and tiles. Out, per experiment (a scene, a seed, a tiling): crops.csv, facts.json, repetition.csv; of each scene's
own tiling 20 x 20 tiles from above and walking, flat and hilly. Gathered: study/results/tables/seams.csv (every crop); in
study/docs/data seam_summary.csv, seam_ablation.csv and repetition.csv, where runs add up; the page study/docs/results/seams.md.
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


rule measure_repetition:
    """Autocorrelation of a large top view and of the exemplar."""
    input:
        levels="<results>/<levels>",
        seams="<results>/<tiles>/seams.json",
        tiles="<results>/<tiles>/tiles",
    output:
        table="<results>/<seams>/repetition.csv",
    log:
        "<logs>/<seams>/measure_repetition.log",
    threads: 2
    resources:
        mem_mb=per_attempt(4000),
        runtime=per_attempt("10m"),
    params:
        tiling=lambda wildcards: config["tilings"][plain_tiling(wildcards)],
        seed=integer("seed"),
        source=code_of_study("measure_repetition"),
    script:
        "../scripts/measure_repetition.py"


rule render_grid:
    """Twenty by twenty tiles, from above and at a walker's height: is there a grid?"""
    input:
        manifest="<results>/<bundle>/davgswt.json",
        chunks="<results>/<bundle>/chunks",
    output:
        pictures=expand(
            "<results>/<seams>/{shot}_{surface}.png",
            shot=["grid", "walker"],
            surface=["flat", "hilly"],
            allow_missing=True,
        ),
    log:
        "<logs>/<seams>/render_grid.log",
    priority: -1
    threads: 1  # most of it places Gaussians, one cell after another
    resources:
        mem_mb=per_attempt(6000),
        runtime=per_attempt("20m"),
    params:
        size=lookup(dpath="stills", within=config),
        source=code_of_study("render_grid"),
    script:
        "../scripts/render_grid.py"


rule gather_seams:
    """Every crop of every cell in one table; what follows from them, added to what earlier runs found; the page and its pictures."""
    input:
        measured=lambda wildcards: [
            cell[name] for cell in seam_experiments() for name in ("table", "facts", "repeats") if name in cell
        ],
        drawn=lambda wildcards: [path for paths in seam_pictures().values() for path in paths],
        template=str(HERE / "report/seams.md"),
    output:
        crops="study/results/tables/seams.csv",
        kept=update(expand("study/docs/data/{table}.csv", table=["seam_summary", "seam_ablation", "repetition"])),
        plot="study/docs/figures/seam_ablation.png",
        sheet="study/docs/figures/seam_sheet.jpg",
        page="study/docs/results/seams.md",
    log:
        "<logs>/seams/gather_seams.log",
    params:
        cells=lambda wildcards: seam_experiments(),
        study=lambda wildcards: STUDY["seams"],
        pictures=lambda wildcards: seam_pictures(),
        own=lambda wildcards: {scene: config["scenes"][scene]["tiling"] for scene in STUDY["seams"]["scenes"]},
        source=code_of_study("gather_seams"),
    script:
        "../scripts/gather_seams.py"


rule plot_cuts:
    """Cuts by colour alone beside those by what the ground is, drawn into the same tiles."""
    input:
        seams=[f"<results>/<round>{{inpainted}}/tiles_{kind}/seams.json" for kind in ("colour", "semantic")],
        tiles=[f"<results>/<round>{{inpainted}}/tiles_{kind}/tiles" for kind in ("colour", "semantic")],
    output:
        plot="<results>/<round>{inpainted}/seam_cuts.png",
    log:
        "<logs>/<round>{inpainted}/plot_cuts.log",
    params:
        source=code_of_study("plot_cuts"),
    script:
        "../scripts/plot_cuts.py"


rule seams:
    """Measure the seams of the config's `seam_study`, and draw what is to be looked at."""
    input:
        rules.gather_seams.output,
        lambda wildcards: [
            path
            for scene in STUDY["seams"]["scenes"]
            for path in expand(list(rules.plot_cuts.output), **seam_branch(scene))
        ],


localrules:
    seams,
