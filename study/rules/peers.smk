"""Another program's fit beside ours, on the same photos and machine.

In: the photos of the scene of the config's `study.compare`, and OpenSplat, a program of the user's, or gsplat and a
GPU. Out: study/docs/data/fitters.csv, figures/fitters.png, study/results/fitters.md. `make compare
OPENSPLAT=/path/to/opensplat` makes them.
"""


def compared_photos(wildcards):
    """The photo set that all programs fit."""
    folder = paths.stage_folder("photos", {"scene": STUDY["compare"]["scene"]})
    return {"frame": str(folder / "ground.json"), "images": str(folder / "images"), "model": str(folder / "sparse")}


rule compare_fitters:
    """Fit the same photos by each program, one after the other, and look at the test photos meanwhile."""
    input:
        unpack(compared_photos),
        template=str(HERE / "report/fitters.md"),
    output:
        table="study/docs/data/fitters.csv",
        plot="study/docs/figures/fitters.png",
        page="study/docs/results/fitters.md",
    log:
        "<logs>/figures/compare_fitters.log",
    threads: 2
    resources:
        mem_mb=per_attempt(8000),
        runtime=per_attempt("60m"),
    params:
        asked=STUDY["compare"],
        source=code_of_study("compare_fitters"),
    script:
        "../scripts/compare_fitters.py"


rule compare:
    """Our fit beside other programs'."""
    input:
        rules.compare_fitters.output,
