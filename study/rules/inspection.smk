"""Pictures of docs/inspect.md: what `dav-gswt inspect` shows of a round of the config's scene.

In: artifacts of the scene's last round. Out: docs/figures/inspect_{shown}.png. Needs the extra `inspect`.
`snakemake --cores 2 --config policy=coverage-w2 rounds=1 -- inspection`
"""

INSPECTED = {  # by the name of the picture: what is opened, and how
    "field": (rules.update_field.output.field, {}),
    "uncertainty": (rules.score_round.output.maps, {}),
    "levels": (rules.make_levels.output.levels, {}),
    "poses": (rules.select_poses.output.poses, {}),
    "photos": (rules.split_views.output.views, {}),
    "tiles": (rules.cut_tiles.output.seams, {}),
    "patches": (rules.cut_tiles.output.seams, {"colour": "patch"}),
    "maps": (rules.score_round.output.shown, {"channel": "w2_sq"}),
    "ground": (rules.score_round.output.shown, {"part": "above"}),
}


rule inspect_artifact:
    """Draw an artefact as `dav-gswt inspect --save` does."""
    input:
        lambda wildcards: expand(
            INSPECTED[wildcards.shown][0], **(branch(config["scene"]) | {"seed": config["seeds"][0]})
        ),
    output:
        picture="docs/figures/inspect_{shown}.png",
    log:
        "<logs>/figures/inspect_{shown}.log",
    benchmark:
        "<benchmarks>/figures/inspect_{shown}.tsv"
    wildcard_constraints:
        shown="|".join(INSPECTED),
    resources:
        mem_mb=per_attempt(3000),
        runtime=per_attempt("10m"),
    params:
        asked=lambda wildcards: INSPECTED[wildcards.shown][1],
        source=code_of_study("inspect_artifact"),
    script:
        "../scripts/inspect_artifact.py"


rule inspection:
    """All pictures of docs/inspect.md."""
    input:
        expand("docs/figures/inspect_{shown}.png", shown=INSPECTED),
