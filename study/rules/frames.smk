"""Frame times of the page on a walk at a fixed height over hills, for several budgets of Gaussians: `snakemake frame_times`.

In: the bundles of the config's `study.frames`, the viewer. Out: frames/page.csv beside each bundle (a headless Chromium);
study/results/tables/frames.csv, viewer.csv and a figure. Needs Chromium and requirements-test.lock. Milliseconds hold for the
machine and its load, which every row names.
"""


rule time_page:
    """Frames as the page draws them, with software rendering."""
    input:
        manifest="<results>/<bundle>/davgswt.json",
        parts="<results>/<bundle>/parts",
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
        asked=lambda wildcards: {
            key: STUDY["frames"][key] for key in ("heights", "flight", "width", "height", "budgets")
        },
        source=code_of_study("time_page"),
    script:
        "../scripts/time_page.py"


rule gather_frames:
    """All scenes in one table and figure; of the page at the first budget what the study's tables show."""
    input:
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
