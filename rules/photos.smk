"""Photos: images with known cameras over a ground frame. World: z up, ground at z = 0, COLMAP camera axes.

In: a folder of photos, a synthetic family, or a finished field. Out: images/, sparse/ (a COLMAP model), ground.json,
report.html, and per seed views.json: photos to start from, photos that may be asked for, photos that only test.
"""


rule choose_frames:
    """Frames of a video: sharp ones, each a little farther along than the one before."""
    input:
        source_video,
    output:
        frames=directory("<results>/<frames>"),
    log:
        "<logs>/<frames>/choose_frames.log",
    benchmark:
        "<benchmarks>/<frames>/choose_frames.tsv"
    wildcard_constraints:
        scene=scenes_of("photos"),
    threads: 2
    resources:
        mem_mb=per_attempt(1500),
        runtime=per_attempt("60m"),
    params:
        source=code_of("choose_frames"),
    script:
        "../scripts/choose_frames.py"


rule register_photos:
    """Structure from motion over a folder of photos; undistorted images and the ground frame."""
    input:
        unpack(source_photos),
    output:
        images=directory("<results>/<photos>/images"),
        model=directory("<results>/<photos>/sparse"),
        lenses="<results>/<photos>/lenses.json",
        frame="<results>/<photos>/ground.json",
    log:
        "<logs>/<photos>/register_photos.log",
    benchmark:
        "<benchmarks>/<photos>/register_photos.tsv"
    wildcard_constraints:
        scene=scenes_of("photos"),
    threads: 2
    resources:
        mem_mb=per_attempt(3000),
        runtime=per_attempt("60m"),
    params:
        scene=scene_keys("register_photos"),
        unnameable=unnameable_photos,
        source=code_of("register_photos"),
    script:
        "../scripts/register_photos.py"


rule render_photos:
    """The start and test views of a synthetic scene, and points triangulated from its exact poses."""
    output:
        images=directory("<results>/<photos>/images"),
        model=directory("<results>/<photos>/sparse"),
        frame="<results>/<photos>/ground.json",
    log:
        "<logs>/<photos>/render_photos.log",
    benchmark:
        "<benchmarks>/<photos>/render_photos.tsv"
    wildcard_constraints:
        scene=scenes_of("synthetic"),
    threads: 2
    resources:
        mem_mb=per_attempt(2500),
        runtime=per_attempt("60m"),
    params:
        scene=scene_keys("render_photos"),
        source=code_of("render_photos"),
    script:
        "../scripts/render_photos.py"


rule import_field:
    """A finished 3DGS .ply, turned into the ground frame."""
    input:
        field=source_field,
    output:
        field="<results>/<photos>/field.ply",
        frame="<results>/<photos>/ground.json",
    log:
        "<logs>/<photos>/import_field.log",
    benchmark:
        "<benchmarks>/<photos>/import_field.tsv"
    wildcard_constraints:
        scene=scenes_of("field"),
    params:
        scene=scene_keys("import_field"),
        source=code_of("import_field"),
    script:
        "../scripts/import_field.py"


rule split_views:
    """Which photos start, which are left to ask for, and which only test."""
    input:
        model="<results>/<photos>/sparse",
        frame="<results>/<photos>/ground.json",
    output:
        views="<results>/<start>/views.json",
    log:
        "<logs>/<start>/split_views.log",
    benchmark:
        "<benchmarks>/<start>/split_views.tsv"
    params:
        scene=scene_keys("split_views"),
        seed=integer("seed"),
        source=code_of("split_views"),
    script:
        "../scripts/split_views.py"


localrules:
    split_views,  # done sooner than a cluster would begin it


rule report_photos:
    """A page that says how the photos fit together, what was left out, and what is weak."""
    input:
        images="<results>/<photos>/images",
        model="<results>/<photos>/sparse",
        frame="<results>/<photos>/ground.json",
        template=str(BASE / "workflow/report/photos.html"),
    output:
        page=report("<results>/<photos>/report.html", category="Photos", labels={"scene": "{scene}"}),
    log:
        "<logs>/<photos>/report_photos.log",
    benchmark:
        "<benchmarks>/<photos>/report_photos.tsv"
    wildcard_constraints:
        scene=scenes_of("photos", "synthetic"),
    resources:
        mem_mb=per_attempt(2000),
        runtime=per_attempt("10m"),
    params:
        source=code_of("report_photos"),
    script:
        "../scripts/report_photos.py"
