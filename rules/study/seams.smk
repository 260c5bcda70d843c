"""Seams measured: does anybody find the borders and the cuts? And does the terrain repeat?

In: the levels and the tiles. Out, per cell (a scene, a seed, a variant of `seams`; restarted by itself): crops.csv,
facts.json (with the share of cuts through strong gradients), repetition.csv, repetition.png; of each scene's own seam
20 x 20 tiles from above and walking, flat and hilly; seam_cuts.png, where colour and semantics cut. Gathered:
results/tables/seams.csv (every crop), seam_summary.csv, seam_ablation.csv and repetition.csv; the last three also in
docs/research/data, where runs add up; docs/research/figures/seam_ablation.png, seam_sheet.jpg and the page docs/research/results/seams.md.
Not part of `all`: `snakemake seams` makes them, for the scenes of the config's `seam_study`.
"""


rule measure_seams:
    """Crops on borders and cuts, beside the same of uncut patches and of tiles cut straight."""
    input:
        unpack(lambda wildcards: describing(wildcards) | lpips_if_fetched(wildcards)),
        levels="<results>/<levels>",
        seams="<results>/<tiles>/seams.json",
        tiles="<results>/<tiles>/tiles",
    output:
        crops="<results>/<seams>/crops.csv",
        facts="<results>/<seams>/facts.json",
    log:
        "<logs>/<seams>/measure_seams.log",
    benchmark:
        "<benchmarks>/<seams>/measure_seams.tsv"
    priority: -1  # after all jobs of two threads: between them one core would stand idle
    threads: 1  # crops are small: two cells beside each other take half the time
    resources:
        mem_mb=growing(4000),
        runtime=growing("20m"),
    params:
        seam=cutting,
        seed=integer("seed"),
        tau=real("tau"),
        source=code_of("study/measure_seams"),
    script:
        "../../scripts/study/measure_seams.py"


rule measure_repetition:
    """Autocorrelation of a large top view and of the exemplar."""
    input:
        levels="<results>/<levels>",
        seams="<results>/<tiles>/seams.json",
        tiles="<results>/<tiles>/tiles",
    output:
        table="<results>/<seams>/repetition.csv",
        plot="<results>/<seams>/repetition.png",
    log:
        "<logs>/<seams>/measure_repetition.log",
    benchmark:
        "<benchmarks>/<seams>/measure_repetition.tsv"
    threads: 2
    resources:
        mem_mb=growing(4000),
        runtime=growing("10m"),
    params:
        seam=cutting,
        seed=integer("seed"),
        source=code_of("study/measure_repetition"),
    script:
        "../../scripts/study/measure_repetition.py"


rule render_grid:
    """Twenty by twenty tiles, from above and at a walker's height: is there a grid?"""
    input:
        manifest="<results>/<bundle>/davgswt.json",
        seams="<results>/<tiles>/seams.json",
        tiles="<results>/<tiles>/tiles",
    output:
        pictures=expand(
            "<results>/<seams>/{shot}_{surface}.png",
            shot=["grid", "walker"],
            surface=["flat", "hilly"],
            allow_missing=True,
        ),
    log:
        "<logs>/<seams>/render_grid.log",
    benchmark:
        "<benchmarks>/<seams>/render_grid.tsv"
    priority: -1
    threads: 1  # most of it places Gaussians, one cell after another
    resources:
        mem_mb=growing(6000),
        runtime=growing("20m"),
    params:
        size=lookup(dpath="stills", within=config),
        source=code_of("study/render_grid"),
    script:
        "../../scripts/study/render_grid.py"


rule gather_seams:
    """Every crop of every cell in one table; what follows from them, added to what earlier runs found."""
    input:
        measured=lambda wildcards: [
            cell[name] for cell in seam_cells() for name in ("table", "facts", "repeats") if name in cell
        ],
    output:
        crops="results/tables/seams.csv",
        summary="results/tables/seam_summary.csv",
        ablation="results/tables/seam_ablation.csv",
        repetition="results/tables/repetition.csv",
        kept=update(expand("docs/research/data/{table}.csv", table=["seam_summary", "seam_ablation", "repetition"])),
        plot="docs/research/figures/seam_ablation.png",
    log:
        "<logs>/seams/gather_seams.log",
    benchmark:
        "<benchmarks>/seams/gather_seams.tsv"
    params:
        cells=lambda wildcards: seam_cells(),
        study=lambda wildcards: config["seam_study"],
        source=code_of("study/gather_seams"),
    script:
        "../../scripts/study/gather_seams.py"


rule write_seams:
    """What was found, as a page to read, and all that was drawn on one sheet."""
    input:
        tables=list(rules.gather_seams.output.kept),
        ablation=rules.gather_seams.output.plot,
        drawn=lambda wildcards: [path for paths in seam_pictures().values() for path in paths],
    output:
        page="docs/research/results/seams.md",
        sheet="docs/research/figures/seam_sheet.jpg",
    log:
        "<logs>/seams/write_seams.log",
    benchmark:
        "<benchmarks>/seams/write_seams.tsv"
    params:
        pictures=lambda wildcards: seam_pictures(),
        own=lambda wildcards: {scene: config["scenes"][scene]["seam"] for scene in config["seam_study"]["scenes"]},
        source=code_of("study/write_seams"),
    script:
        "../../scripts/study/write_seams.py"


rule plot_cuts:
    """Cuts by colour alone beside those by what the ground is, drawn into the same tiles."""
    input:
        seams=[f"<results>/<round>{{inpainted}}/tiles_{kind}/seams.json" for kind in ("colour", "semantic")],
        tiles=[f"<results>/<round>{{inpainted}}/tiles_{kind}/tiles" for kind in ("colour", "semantic")],
    output:
        plot=report(
            "<results>/<round>{inpainted}/seam_cuts.png",
            caption="../../workflow/report/cuts.rst",
            category="Figures",
            labels={"figure": "cuts by colour and by kind of ground", "scene": "{scene}"},
        ),
    log:
        "<logs>/<round>{inpainted}/plot_cuts.log",
    benchmark:
        "<benchmarks>/<round>{inpainted}/plot_cuts.tsv"
    params:
        source=code_of("study/plot_cuts"),
    script:
        "../../scripts/study/plot_cuts.py"


rule seams:
    """Measure the seams of the config's `seam_study`, and draw what is to be looked at."""
    input:
        lambda wildcards: list(rules.gather_seams.output),
        lambda wildcards: list(rules.write_seams.output),
        lambda wildcards: [
            path
            for scene in config["seam_study"]["scenes"]
            for path in expand(list(rules.plot_cuts.output), **seam_values(scene))
        ],


localrules:
    seams,
