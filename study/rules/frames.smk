"""Frame times on a walk at a fixed height over hills, for several budgets of Gaussians in view: `snakemake frame_times`.

In: the bundles of the config's `study.frames`, the viewer. Out, beside each bundle: frames/library.csv (rendered by the library on
the CPU), frames/page.csv (by the page in a headless Chromium), frames/flicker.csv (what changes from a frame to the next of a
slow walk); study/results/tables/frames.csv, viewer.csv and a figure. Needs Chromium and requirements-test.lock. Milliseconds hold
for the machine and its load, which every row names.
"""


rule time_library:
    """Frames as the library draws them."""
    input:
        manifest="<results>/<bundle>/davgswt.json",
        chunks="<results>/<bundle>/chunks",
    output:
        table="<results>/<bundle>/frames/library.csv",
    log:
        "<logs>/<bundle>/time_library.log",
    benchmark:
        "<benchmarks>/<bundle>/time_library.tsv"
    threads: 2
    resources:
        mem_mb=per_attempt(4000),
        runtime=per_attempt("1h"),
    params:
        asked=walk_settings,
        source=code_of_study("time_library"),
    script:
        "../scripts/time_library.py"


rule time_page:
    """Frames as the page draws them, with software rendering."""
    input:
        manifest="<results>/<bundle>/davgswt.json",
        chunks="<results>/<bundle>/chunks",
        viewer=VIEWER,
    output:
        table="<results>/<bundle>/frames/page.csv",
    log:
        "<logs>/<bundle>/time_page.log",
    benchmark:
        "<benchmarks>/<bundle>/time_page.tsv"
    threads: 2
    resources:
        mem_mb=per_attempt(3000),
        runtime=per_attempt("2h"),
    params:
        asked=walk_settings,
        source=code_of_study("time_page"),
    script:
        "../scripts/time_page.py"


rule measure_flicker:
    """Whether anything jumps from a frame to the next."""
    input:
        manifest="<results>/<bundle>/davgswt.json",
        chunks="<results>/<bundle>/chunks",
    output:
        table="<results>/<bundle>/frames/flicker.csv",
    log:
        "<logs>/<bundle>/measure_flicker.log",
    benchmark:
        "<benchmarks>/<bundle>/measure_flicker.tsv"
    threads: 2
    resources:
        mem_mb=per_attempt(4000),
        runtime=per_attempt("1h"),
    params:
        heights=lambda wildcards: STUDY["frames"]["heights"],
        walk=lambda wildcards: {
            "count": STUDY["frames"]["pairs"],
            "length": STUDY["frames"]["flight"]["length"],
            "width": STUDY["frames"]["width"],
            "height": STUDY["frames"]["height"],
            "budget": max(STUDY["frames"]["budgets"]),
        },
        source=code_of_study("measure_flicker"),
    script:
        "../scripts/measure_flicker.py"


rule gather_frames:
    """All scenes in one table; of the page at the first budget what the study's tables show."""
    input:
        library=lambda wildcards: list(measured_of_tiles(rules.time_library, "frames")),
        page=lambda wildcards: list(measured_of_tiles(rules.time_page, "frames")),
    output:
        table="study/results/tables/frames.csv",
        viewer=FRAMES,
        kept="study/docs/data/frames.csv",
    log:
        "<logs>/tables/gather_frames.log",
    benchmark:
        "<benchmarks>/tables/gather_frames.tsv"
    params:
        cells=lambda wildcards: list(measured_of_tiles(rules.time_page, "frames").values()),
        source=code_of_study("gather_frames"),
    script:
        "../scripts/gather_frames.py"


rule plot_frames:
    """Milliseconds over Gaussians in view."""
    input:
        table=rules.gather_frames.output.table,
    output:
        plot="study/results/figures/frames.png",
        kept="study/docs/figures/frames.png",
    log:
        "<logs>/figures/plot_frames.log",
    benchmark:
        "<benchmarks>/figures/plot_frames.tsv"
    params:
        source=code_of_study("plot_frames"),
    script:
        "../scripts/plot_frames.py"


rule frame_times:
    """How long a frame takes: tables and figure."""
    input:
        lambda wildcards: list(measured_of_tiles(rules.measure_flicker, "frames")),
        rules.gather_frames.output.viewer,
        rules.plot_frames.output.plot,


localrules:
    frame_times,
