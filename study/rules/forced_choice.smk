"""Forced choice: people choose which of two crops has the less visible seam. study/docs/results/forced-choice.md.

In: levels and tiles of each tiling that is compared; the answers that people saved. Out, per scene:
forced_choice/{scene}/pairs; forced_choice/kit/page, a page that works offline and does not say which crop is which, and
kit/key.json, which does; study/results/tables/forced_choice.csv and its figure. `snakemake perceptual_kit`, `perceptual_results`.
"""

PAGE_PARTS = sorted(str(path) for path in (HERE / "forced_choice").iterdir() if path.is_file())
ANSWERS_SCHEMA = str(HERE / "answers.schema.json")


rule render_pairs:
    """A scene's crops, two of a place: cut in two ways, or cut and whole; and attention checks."""
    input:
        unpack(pair_inputs),
    output:
        pairs=directory("study/results/forced_choice/{scene}/pairs"),
    log:
        "<logs>/forced_choice/{scene}/render_pairs.log",
    threads: 2
    resources:
        mem_mb=per_attempt(6000),
        runtime=per_attempt("30m"),
    params:
        tilings=lambda wildcards: compared_tilings(),
        study=lambda wildcards: {
            key: STUDY["forced_choice"][key] for key in ("pairs", "crops", "checks", "size", "seed")
        },
        salt=lambda wildcards: config["seeds"][0],
        tau=lambda wildcards: float(config["tau"]),
        source=code_of_study("render_pairs"),
    script:
        "../scripts/render_pairs.py"


rule make_kit:
    """All pairs as a page with trial lists, and the key to it."""
    input:
        pairs=lambda wildcards: expand(rules.render_pairs.output.pairs, scene=STUDY["forced_choice"]["scenes"]),
        parts=PAGE_PARTS,
    output:
        page=directory("study/results/forced_choice/kit/page"),
        key="study/results/forced_choice/kit/key.json",
    log:
        "<logs>/forced_choice/make_kit.log",
    params:
        scenes=lambda wildcards: STUDY["forced_choice"]["scenes"],
        seed=lambda wildcards: STUDY["forced_choice"]["seed"],
        source=code_of_study("make_kit"),
    script:
        "../scripts/make_kit.py"


rule evaluate_answers:
    """How often people chose which, clustered by participant; and the model observer, in rows of its own."""
    input:
        unpack(saved_answers),
        key=rules.make_kit.output.key,
        schema=ANSWERS_SCHEMA,
    output:
        table="study/results/tables/forced_choice.csv",
        plot="study/results/figures/forced_choice.png",
        facts="study/results/forced_choice/participants.json",
    log:
        "<logs>/forced_choice/evaluate_answers.log",
    params:
        source=code_of_study("evaluate_answers"),
    script:
        "../scripts/evaluate_answers.py"


rule perceptual_kit:
    """The page to be answered."""
    input:
        rules.make_kit.output,


rule perceptual_results:
    """What was answered."""
    input:
        rules.evaluate_answers.output,


localrules:
    perceptual_kit,
    perceptual_results,
