"""Terrain: the tiles placed without end, as a page to walk in and as stills.

In: the bundle. Out: page/ (`make view` serves it), walker.png, oblique.png, above.png, the three small in stills.jpg.
"""


rule make_page:
    """A page that needs nothing else: viewer, manifest, surface, parts, a first still and how it was made in one folder."""
    input:
        unpack(height_map),
        unpack(painted_files),
        unpack(story_of_field),
        still="<results>/<terrain>/walker.png",
        manifest="<results>/<bundle>/davgswt.json",
        parts="<results>/<bundle>/parts",
        viewer=VIEWER,
    output:
        page=directory("<results>/<terrain>/page"),
    log:
        "<logs>/<terrain>/make_page.log",
    benchmark:
        "<benchmarks>/<terrain>/make_page.tsv"
    params:
        heights=lookup(dpath="heights", within=config),
        classes=lookup(dpath="classes", within=config),
        sun=lookup(dpath="sun", within=config),
        wind=lookup(dpath="wind", within=config),
        source=code_of("make_page"),
    script:
        "../scripts/make_page.py"


localrules:
    make_page,  # copies files


rule render_terrain:
    """Stills of the endless terrain: walking, from a hill, and from above."""
    input:
        unpack(height_map),
        unpack(painted_files),
        manifest="<results>/<bundle>/davgswt.json",
        parts="<results>/<bundle>/parts",
    output:
        stills=expand("<results>/<terrain>/{shot}.png", shot=["walker", "oblique", "above"], allow_missing=True),
    log:
        "<logs>/<terrain>/render_terrain.log",
    benchmark:
        "<benchmarks>/<terrain>/render_terrain.tsv"
    threads: 2
    resources:
        mem_mb=per_attempt(4000),
        runtime=per_attempt("20m"),
    params:
        size=lookup(dpath="stills", within=config),
        heights=lookup(dpath="heights", within=config),
        classes=lookup(dpath="classes", within=config),
        sun=lookup(dpath="sun", within=config),
        source=code_of("render_terrain"),
    script:
        "../scripts/render_terrain.py"


rule make_contact_sheet:
    """The stills beside each other, small enough for a report of many scenes."""
    input:
        stills=rules.render_terrain.output.stills,
    output:
        sheet=report(
            "<results>/<terrain>/stills.jpg",
            caption="../workflow/report/stills.rst",
            category="Terrain",
            labels={"scene": "{scene}", "preset": "{preset}"},
        ),
    log:
        "<logs>/<terrain>/make_contact_sheet.log",
    benchmark:
        "<benchmarks>/<terrain>/make_contact_sheet.tsv"
    params:
        source=code_of("make_contact_sheet"),
    script:
        "../scripts/make_contact_sheet.py"
