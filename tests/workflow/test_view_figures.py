"""Figures of active views: what they are made of, and that they come out of a run."""

import re
import shutil

import pytest
from fixtures.runs import TINY, USUAL

from dav_gswt.images import image_files

CELL = "results/desert/seed0/draft/active_farthest_none_pdrop0_lam0_k{k}"
SCORED = "results/desert/seed0/draft/coarse/scores_none_pdrop0/scores.csv"


def inputs(told, rule):
    """The inputs of a rule's one job, as a dry run tells them."""
    (found,) = re.findall(rf"^(?:local)?rule {rule}:\n    input: (.+)$", told, re.M)
    return found.split(", ")


@pytest.mark.parametrize(
    "figure, jobs",
    [
        pytest.param("sphere_1", dict(score_coarse=1, select_poses=1, plot_sphere=1), id="poses, and no photo of them"),
        pytest.param("sphere_2", dict(select_poses=2, capture_views=1, update_field=1, score_round=1), id="two rounds"),
        pytest.param("evolution_1", dict(evaluate_coarse=1, evaluate_round=1, plot_evolution=1), id="one round"),
        pytest.param("evolution_3", dict(evaluate_coarse=1, evaluate_round=2, update_field=3), id="no metrics between"),
    ],
)
def test_a_figure_asks_for_the_rounds_that_it_shows(planned, tmp_path, figure, jobs):
    plan = planned(tmp_path, f"{CELL.format(k=4)}/{figure}.png")
    ours = ("score_coarse", "select_poses", "capture_views", "update_field", "score_round", "evaluate_round")
    assert {rule: plan[rule] for rule in jobs} == jobs
    assert figure != "sphere_1" or not any(plan[rule] for rule in ours[2:])


def test_each_round_is_shown_by_what_it_chose_from(snakemake, tmp_path):
    cell = CELL.format(k=4)
    told = snakemake(tmp_path, f"{cell}/sphere_3.png", f"{cell}/evolution_3.png", "--dry-run").stdout
    asked = inputs(told, "plot_sphere")
    assert asked[:3] == [SCORED, *(f"{cell}/iter{t}/scores.csv" for t in (1, 2))]
    assert asked[3:6] == [f"{cell}/iter{t}/poses.json" for t in (1, 2, 3)]
    assert asked[6:8] == [f"{cell}/iter{t}/capture" for t in (1, 2)]
    asked = inputs(told, "plot_evolution")
    homes = ["results/desert/seed0/draft/coarse", f"{cell}/iter1", f"{cell}/iter3"]
    files = [f"{home}/{file}" for file in ("field.ply", "ground.exr", "metrics.json") for home in homes]
    assert asked[:9] == files and not [path for path in asked if path.endswith("capture")]


@pytest.mark.parametrize("name", ["sphere_0", "evolution_0", "sphere_01"])
def test_a_round_that_chose_nothing_has_no_figure(snakemake, tmp_path, name):
    done = snakemake(tmp_path, f"{CELL.format(k=4)}/{name}.png", "--dry-run", check=False)
    assert done.returncode != 0 and "MissingRule" in done.stdout


def test_a_finished_run_has_both_figures(snakemake, tiny, tmp_path):
    folder = shutil.copytree(tiny.folder, tmp_path / "run", symlinks=True)
    made = [f"{CELL.format(k=2)}/{figure}_1.png" for figure in ("sphere", "evolution")]
    done = snakemake(folder, "--cores", "2", *made, configs=(USUAL, TINY))
    assert "2 of 2 steps (100%) done" in done.stdout  # all they need is there
    for path in made:
        assert image_files.read_size(folder / path)[0] >= 1000 and image_files.read_photo(folder / path).std() > 0.05
