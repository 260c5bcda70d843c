"""Inpainting: ground that no photo saw is painted by a prior, where the config asks for it (`inpaint`).

In: the last round's field, ground and photos. Out: field.ply, in which what is painted is marked and all else keeps its bytes;
ground.exr, unchanged; completion.json, how much was painted; metrics.json, the test photos before and after.
"""


rule inpaint_field:
    """Inpaint the ground that no photo saw; a field without such ground is copied."""
    input:
        unpack(inpainter_weights),
        field="<results>/<round>/field.ply",
        ground="<results>/<round>/ground.exr",
        views="<results>/<start>/views.json",
        images="<results>/<photos>/images",
        model="<results>/<photos>/sparse",
        frame="<results>/<photos>/ground.json",
        captures=captures_until,
    output:
        field="<results>/<round>/inpainted_{inpainter}/field.ply",
        ground="<results>/<round>/inpainted_{inpainter}/ground.exr",
        facts="<results>/<round>/inpainted_{inpainter}/completion.json",
    log:
        "<logs>/<round>/inpainted_{inpainter}/inpaint_field.log",
    benchmark:
        "<benchmarks>/<round>/inpainted_{inpainter}/inpaint_field.tsv"
    wildcard_constraints:
        policy=CHOOSING,
    threads: 2
    resources:
        mem_mb=per_attempt(3000),
        runtime=per_attempt("30m"),
    params:
        prior=entry("priors", "inpainter"),
        seed=integer("seed"),
        source=code_of("inpaint_field"),
    script:
        "../scripts/inpaint_field.py"
