"""Settings of the trade-off share what they have in common; a finished run makes tables, figures and pages."""

import csv
import shutil

from fixtures.runs import TINY, USUAL

from dav_gswt.images import image_files

SMALL = """
study:
  tradeoff:
    scene: desert
    base: {preset: draft, tiling: semantic, prior: terrain}
    presets: [draft]
    only: [%s]
    knobs:
      max_gaussians: {values: [20000, 10000]}
      candidates: {values: [24, 6]}
      level_steps: {values: [10, 5]}
"""


def small(folder, *knobs):
    (path := folder / "small.yaml").write_text(SMALL % ", ".join(knobs))
    return USUAL, TINY, path


def test_settings_share_what_they_have_in_common(planned, tmp_path):
    configs = small(tmp_path, "max_gaussians", "level_steps", "tau", "candidates")
    plan = planned(tmp_path, "results/tradeoff/tradeoff.csv", configs=configs)
    wanted = dict(
        render_photos=1,
        fit_coarse=3,  # the base, the cap, and the level's steps, as these belong to a quality
        update_field=3,
        make_levels=3,
        cut_tiles=4,  # and the other candidates
        bundle_tiles=6,  # and two other taus
        render_terrain=4,  # the level's steps, tau and what they are compared with
        measure_seams=2,
        evaluate_at=3,
        evaluate_round=0,
    )
    assert {rule: plan[rule] for rule in wanted} == wanted


def test_settings_of_a_preset_share_the_rounds_of_the_one_that_chooses_for_it(planned, tmp_path):
    (path := tmp_path / "small.yaml").write_text(SMALL.replace("preset: draft", "preset: standard") % "max_gaussians")
    plan = planned(tmp_path, "results/tradeoff/tradeoff.csv", configs=(USUAL, TINY, path))
    # the base, two numbers of Gaussians, and the draft, whose fits the others' rounds are
    wanted = dict(
        fit_coarse=1, update_field=1, select_poses=1, fit_chosen_photos=3, copy_chosen_photos=3, evaluate_at=4
    )
    assert {rule: plan[rule] for rule in wanted} == wanted


def test_a_finished_run_is_measured_drawn_and_told(snakemake, tiny, tmp_path):
    """What the tiny run made is there already: the settings are tau 0, 0.6 (the base) and 1 of its tiles."""
    folder = shutil.copytree(tiny.folder, tmp_path / "run", symlinks=True)
    configs = small(tmp_path, "tau")
    done = snakemake(
        folder, "--cores", "2", "--scheduler", "greedy", "docs/research/results/tradeoff.md", configs=configs
    )
    assert "8 of 8 steps (100%) done" in done.stdout  # metrics, two bundles and their stills, table, plot, page
    with (folder / "results/tradeoff/tradeoff.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert [(row["knob"], row["setting"]) for row in rows] == [
        ("preset", "draft"),
        ("tau", "0"),
        ("tau", "0.6"),
        ("tau", "1"),
    ]
    assert all(float(row[key]) > 0 for row in rows for key in ("seconds", "own_seconds", "psnr", "bundle_mb"))
    assert all(float(row["loss"]) == 0 for row in rows if row["most"] == "1")
    assert "`draft` is the best for its time" in (folder / "docs/research/results/tradeoff.md").read_text()
    assert (folder / "docs/research/data/tradeoff.csv").read_text().count("\n") == len(rows) + 1
    for path in (
        "results/tradeoff/pareto.png",
        "results/tradeoff/knobs.png",
        "docs/research/figures/tradeoff_knobs.png",
    ):
        assert image_files.read_size(folder / path)[0] > 300
