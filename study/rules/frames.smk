"""Frame times on a walk at a fixed height over hills, for several budgets of Gaussians in view: `snakemake frame_times`.

In: the bundles of the config's `study.frames`, the viewer. Out, beside each bundle: frames/library.csv (rendered by the library on
the CPU), frames/page.csv (by the page in a headless Chromium); study/results/tables/frames.csv, viewer.csv and a figure. Needs Chromium
and requirements-test.lock. Milliseconds hold for the machine and its load, which every row names.
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
    threads: 2
    resources:
        mem_mb=per_attempt(4000),
        runtime=per_attempt("1h"),
    params:
        asked=walk_settings,
        source=code_of_study("time_frames"),
    script:
        "../scripts/time_frames.py"


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
    threads: 2
    resources:
        mem_mb=per_attempt(3000),
        runtime=per_attempt("2h"),
    params:
        asked=walk_settings,
        source=code_of_study("time_frames"),
    script:
        "../scripts/time_frames.py"


rule gather_frames:
    """All scenes in one table and figure; of the page at the first budget what the study's tables show."""
    input:
        library=lambda wildcards: list(measured_of_tiles(rules.time_library, "frames")),
        page=lambda wildcards: list(measured_of_tiles(rules.time_page, "frames")),
    output:
        table="study/results/tables/frames.csv",
        viewer=FRAMES,
        kept="study/docs/data/frames.csv",
        plot="study/docs/figures/frames.png",
    log:
        "<logs>/tables/gather_frames.log",
    params:
        cells=lambda wildcards: list(measured_of_tiles(rules.time_page, "frames").values()),
        source=code_of_study("gather_frames"),
    script:
        "../scripts/gather_frames.py"


rule frame_times:
    """How long a frame takes: tables and figure."""
    input:
        rules.gather_frames.output,
