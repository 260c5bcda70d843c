"""The perceptual study: which of two crops has the less visible seam? A kit for people, and what follows from answers.

In: the levels and, of each seam that is compared, the tiles; the files that people saved, in the folder `answers` of the
config's `perceptual_study`. Out, per scene: perceptual/{scene}/pairs, the crops; for all: perceptual/kit/page, a page that works
offline and does not say which crop is which, perceptual/kit/key.json, which does; results/tables/perceptual.csv,
results/figures/perceptual.png and perceptual/participants.json, who was counted.
Not part of `all`: `snakemake perceptual_kit` and `snakemake perceptual_results`; docs/research/results/forced-choice.md says how to run it.
"""


rule render_pairs:
    """A scene's crops, two of a place: cut in two ways, or cut and whole; and attention checks."""
    input:
        unpack(perceptual_inputs),
    output:
        pairs=directory("<results>/perceptual/{scene}/pairs"),
    log:
        "<logs>/perceptual/{scene}/render_pairs.log",
    benchmark:
        "<benchmarks>/perceptual/{scene}/render_pairs.tsv"
    threads: 2
    resources:
        mem_mb=growing(6000),
        runtime=growing("30m"),
    params:
        seams=lambda wildcards: perceptual_seams(),
        study=lambda wildcards: {
            key: config["perceptual_study"][key] for key in ("pairs", "crops", "checks", "size", "seed")
        },
        salt=lambda wildcards: config["seeds"][0],
        tau=lambda wildcards: float(config["tau"]),
        source=code_of("study/render_pairs"),
    script:
        "../../scripts/study/render_pairs.py"


rule make_kit:
    """All pairs as a page with trial lists, and the key to it."""
    input:
        pairs=lambda wildcards: expand(rules.render_pairs.output.pairs, scene=config["perceptual_study"]["scenes"]),
        parts=TRIALS,
    output:
        page=directory("<results>/perceptual/kit/page"),
        key="<results>/perceptual/kit/key.json",
    log:
        "<logs>/perceptual/make_kit.log",
    benchmark:
        "<benchmarks>/perceptual/make_kit.tsv"
    params:
        scenes=lambda wildcards: config["perceptual_study"]["scenes"],
        seed=lambda wildcards: config["perceptual_study"]["seed"],
        source=code_of("study/make_kit"),
    script:
        "../../scripts/study/make_kit.py"


rule evaluate_answers:
    """How often people chose which, clustered by participant; and the model observer, in rows of its own."""
    input:
        unpack(answers_given),
        key=rules.make_kit.output.key,
        schema=ANSWERS_SCHEMA,
    output:
        table="results/tables/perceptual.csv",
        plot=report(
            "results/figures/perceptual.png",
            caption="../../workflow/report/perceptual.rst",
            category="Figures",
            labels={"figure": "which seams are harder to see"},
        ),
        facts="results/perceptual/participants.json",
    log:
        "<logs>/perceptual/evaluate_answers.log",
    benchmark:
        "<benchmarks>/perceptual/evaluate_answers.tsv"
    params:
        source=code_of("study/evaluate_answers"),
    script:
        "../../scripts/study/evaluate_answers.py"


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
