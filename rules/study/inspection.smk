"""Pictures of docs/inspect.md: what `dav-gswt inspect` shows of a round of the config's scene.

In: photos, scores, poses, field, levels, tiles and maps of the scene's last round. Out: docs/research/figures/inspect_{shown}.png.
Not part of `all`: `snakemake --cores 2 --config policy=w2-lpips-diverse rounds=1 -- inspection` makes them. Needs the extra
`inspect`.
"""


rule inspect_artifact:
    """Draw an artefact as `dav-gswt inspect --save` does."""
    input:
        lambda wildcards: expand(
            INSPECTED[wildcards.shown][0], **(values_of(config["scene"]) | {"seed": config["seeds"][0]})
        ),
    output:
        picture="docs/research/figures/inspect_{shown}.png",
    log:
        "<logs>/figures/inspect_{shown}.log",
    benchmark:
        "<benchmarks>/figures/inspect_{shown}.tsv"
    wildcard_constraints:
        shown="|".join(INSPECTED),
    resources:
        mem_mb=growing(3000),
        runtime=growing("10m"),
    params:
        asked=lambda wildcards: INSPECTED[wildcards.shown][1],
        source=code_of("study/inspect_artifact"),
    script:
        "../../scripts/study/inspect_artifact.py"


rule inspection:
    """All pictures of docs/inspect.md."""
    input:
        expand("docs/research/figures/inspect_{shown}.png", shown=INSPECTED),
