"""The picture of examples/rover: a rover in MuJoCo on an exported ground, and what its camera sees.

In: the page and the tiles of the config's scene. Out: docs/figures/rover.webp. Needs the package mujoco.
`snakemake --cores 2 docs/figures/rover.webp`
"""


rule draw_rover:
    """Export the terrain about the origin, drive over it, and draw both views."""
    input:
        lambda wildcards: expand(
            [rules.cut_tiles.output.seams, rules.cut_tiles.output.tiles],
            **(branch(config["scene"]) | {"seed": config["seeds"][0]}),
        ),
        page=lambda wildcards: expand(
            rules.make_page.output.page, **(branch(config["scene"]) | {"seed": config["seeds"][0]})
        ),
        example=str(BASE / "examples/rover/rover.py"),
        rover=str(BASE / "examples/rover/rover.xml"),
    output:
        picture="docs/figures/rover.webp",
    log:
        "<logs>/figures/rover.log",
    benchmark:
        "<benchmarks>/figures/rover.tsv"
    resources:
        mem_mb=per_attempt(3000),
        runtime=per_attempt("20m"),
    params:
        export=["--columns", "12", "--rows", "12", "--format", "ply", "--format", "ground"],
        seconds=8,
        source=code_of_study("draw_rover"),
    script:
        "../scripts/draw_rover.py"
