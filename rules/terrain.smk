"""Terrain: the tiles laid without end, as a page to walk in and as stills.

In: the bundle and the tiles. Out: page/ (open it with `make view`), walker.png, oblique.png, above.png.
"""


rule make_page:
    """A page that needs nothing else: viewer, manifest and chunks in one folder."""
    input:
        manifest="<results>/<bundle>/davgswt.json",
        chunks="<results>/<bundle>/chunks",
        viewer=VIEWER,
    output:
        page=directory("<results>/<terrain>/page"),
    log:
        "<logs>/<terrain>/make_page.log",
    benchmark:
        "<benchmarks>/<terrain>/make_page.tsv"
    params:
        source=source_of("terrain/page"),
    script:
        "../scripts/make_page.py"


rule render_terrain:
    """Stills of the endless terrain: walking, from a hill, and from above."""
    input:
        manifest="<results>/<bundle>/davgswt.json",
        seams="<results>/<tiles>/seams.json",
        tiles="<results>/<tiles>/tiles",
    output:
        stills=report(
            expand("<results>/<terrain>/{shot}.png", shot=["walker", "oblique", "above"], allow_missing=True),
            caption="../workflow/report/stills.rst",
            category="Terrain",
            labels={"scene": "{scene}", "quality": "{quality}"},
        ),
    log:
        "<logs>/<terrain>/render_terrain.log",
    benchmark:
        "<benchmarks>/<terrain>/render_terrain.tsv"
    threads: 2
    resources:
        mem_mb=4000,
        runtime="20m",
    params:
        size=lookup(dpath="stills", within=config),
        source=source_of("terrain", "raster"),
    script:
        "../scripts/render_terrain.py"
