"""Pictures of docs/exports.md: what other programs draw of each export of the config's scene.

In: the page and the tiles. Out: docs/figures/exit_{name}.jpg. Needs Chromium, Node.js (`npm ci --prefix examples`), and mujoco
with EGL. `snakemake --cores 2 docs/figures/exit_spz.jpg`
"""

EXITS = ["spz", "ply", "sog", "glb", "glb_points", "3dtiles", "ground", "mujoco"]


rule draw_exits:
    """Export the terrain about the origin, and have other programs draw it."""
    input:
        lambda wildcards: expand(
            [rules.cut_tiles.output.seams, rules.cut_tiles.output.tiles],
            **(branch(config["scene"]) | {"seed": config["seeds"][0]}),
        ),
        page=lambda wildcards: expand(
            rules.make_page.output.page, **(branch(config["scene"]) | {"seed": config["seeds"][0]})
        ),
        server=str(BASE / "examples/serve.py"),
        viewer=[str(BASE / "examples" / name) for name in ("exits", "package-lock.json")],
    output:
        pictures=expand("docs/figures/exit_{name}.jpg", name=EXITS),
    log:
        "<logs>/figures/exits.log",
    benchmark:
        "<benchmarks>/figures/exits.tsv"
    resources:
        mem_mb=per_attempt(3000),
        runtime=per_attempt("20m"),
    params:
        source=code_of_study("draw_exits"),
    script:
        "../scripts/draw_exits.py"
