"""Terrain: the tiles laid without end, as a page to walk in, as stills and, where the config asks, as a flight.

In: the bundle. Out: page/ (open it with `make view`), walker.png, oblique.png, above.png, these three small in stills.jpg,
flight/; beside the bundle, where asked for, presort.csv: what the page's shortcuts do to a picture. `snakemake
presort_table` gathers those of the config's `lod`.
"""


rule make_page:
    """A page that needs nothing else: viewer, manifest, surface and chunks in one folder."""
    input:
        unpack(height_map),
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
        heights=lookup(dpath="heights", within=config),
        source=source_of("terrain/page", "terrain/heights", "terrain/choice", "bundle/manifest"),
    script:
        "../scripts/make_page.py"


localrules:
    make_page,  # copies files


rule render_terrain:
    """Stills of the endless terrain: walking, from a hill, and from above."""
    input:
        unpack(height_map),
        manifest="<results>/<bundle>/davgswt.json",
        chunks="<results>/<bundle>/chunks",
    output:
        stills=expand("<results>/<terrain>/{shot}.png", shot=["walker", "oblique", "above"], allow_missing=True),
    log:
        "<logs>/<terrain>/render_terrain.log",
    benchmark:
        "<benchmarks>/<terrain>/render_terrain.tsv"
    threads: 2
    resources:
        mem_mb=growing(4000),
        runtime=growing("20m"),
    params:
        size=lookup(dpath="stills", within=config),
        heights=lookup(dpath="heights", within=config),
        schema=BUNDLE_SCHEMA,
        source=source_of("terrain", "bundle", "raster"),
    script:
        "../scripts/render_terrain.py"


rule show_stills:
    """The stills beside each other, small enough for a report of many scenes."""
    input:
        stills=rules.render_terrain.output.stills,
    output:
        sheet=report(
            "<results>/<terrain>/stills.jpg",
            caption="../workflow/report/stills.rst",
            category="Terrain",
            labels={"scene": "{scene}", "quality": "{quality}"},
        ),
    log:
        "<logs>/<terrain>/show_stills.log",
    benchmark:
        "<benchmarks>/<terrain>/show_stills.tsv"
    params:
        source=source_of("figures"),
    script:
        "../scripts/show_stills.py"


rule render_flight:
    """A walk over the endless terrain, frame by frame: does anything flicker, tear or jump?"""
    input:
        unpack(height_map),
        manifest="<results>/<bundle>/davgswt.json",
        chunks="<results>/<bundle>/chunks",
    output:
        frames=directory("<results>/<terrain>/flight"),
    log:
        "<logs>/<terrain>/render_flight.log",
    benchmark:
        "<benchmarks>/<terrain>/render_flight.tsv"
    threads: 2
    resources:
        mem_mb=growing(4000),
        runtime=growing("4h"),
    params:
        size=lookup(dpath="stills", within=config),
        heights=lookup(dpath="heights", within=config),
        flight=lookup(dpath="flight", within=config),
        schema=BUNDLE_SCHEMA,
        source=source_of("terrain", "bundle", "raster"),
    script:
        "../scripts/render_flight.py"


rule measure_shortcuts:
    """What pre-sorted orders, levels and rounding do to a picture, against all Gaussians sorted exactly."""
    input:
        manifest="<results>/<bundle>/davgswt.json",
        chunks="<results>/<bundle>/chunks",
        seams="<results>/<tiles>/seams.json",
        tiles="<results>/<tiles>/tiles",
    output:
        table="<results>/<bundle>/presort.csv",
    log:
        "<logs>/<bundle>/measure_shortcuts.log",
    benchmark:
        "<benchmarks>/<bundle>/measure_shortcuts.tsv"
    threads: 2
    resources:
        mem_mb=growing(4000),
        runtime=growing("20m"),
    params:
        schema=BUNDLE_SCHEMA,
        source=source_of("terrain", "bundle", "raster"),
    script:
        "../scripts/measure_shortcuts.py"


use rule gather_lod as gather_presort with:
    input:
        tables=lambda wildcards: list(measured_of_tiles(rules.measure_shortcuts)),
    output:
        table="results/tables/presort.csv",
    log:
        "<logs>/tables/gather_presort.log",
    benchmark:
        "<benchmarks>/tables/gather_presort.tsv"
    params:
        cells=lambda wildcards: list(measured_of_tiles(rules.measure_shortcuts).values()),
        source=source_of("figures"),


rule plot_presort:
    """The same as a figure; both are kept in docs, too."""
    input:
        table=rules.gather_presort.output.table,
    output:
        plot="results/figures/presort.png",
        kept="docs/figures/presort.png",
        data="docs/data/presort.csv",
    log:
        "<logs>/figures/plot_presort.log",
    benchmark:
        "<benchmarks>/figures/plot_presort.tsv"
    params:
        source=source_of("terrain/shortcuts", "figures"),
    script:
        "../scripts/plot_presort.py"


rule presort_table:
    """What the page's shortcuts cost: table and figure."""
    input:
        rules.gather_presort.output.table,
        rules.plot_presort.output.plot,


localrules:
    presort_table,
