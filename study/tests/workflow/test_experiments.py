"""Experiments of the study on the tiny run: tables, figures and pages come out, and nothing is made twice."""

import csv
import json
import shutil
from pathlib import Path

import answer_files
import pytest
import yaml
from fixtures.runs import TINY, USUAL

from dav_gswt.files import read_json
from dav_gswt.images import image_files
from dav_gswt_study.tables import spread

CONFIGS = (USUAL, TINY, "study/tests/config.yaml")
CELL = "results/desert/seed0/draft/active_farthest_none_pdrop0_lam0_k2"


@pytest.fixture
def copied(tiny, tmp_path) -> Path:
    """A copy of the tiny run, for experiments that add to it."""
    return shutil.copytree(tiny.folder, tmp_path / "run", symlinks=True)


def write_study(folder: Path, **study) -> tuple:
    """Config files of the tiny run with other settings of the study."""
    (path := folder / "few.yaml").write_text(yaml.safe_dump({"study": study}))
    return USUAL, TINY, path


def read_rows(path: Path) -> list[dict]:
    with path.open(newline="") as file:
        return list(csv.DictReader(file))


def test_a_finished_run_is_swept_without_making_anything_twice(snakemake, tiny, copied, tmp_path):
    """tau over what is there: one bundle, its stills and the orders of both are new.

    Made are a table, a figure, and what tables make of them.
    """
    sweep = {"scenes": ["desert"], "vary": {"tau": [0.3, 0.6]}, "fixed": {"policy": "farthest"}, "baseline": "0.6"}
    sweep |= {"measure": {"views": [0], "tiles": [0], "stills": [0]}}
    figures = {"scenes": ["desert"], "seed": 0, "estimators": ["w2"], "policy": "farthest", "rounds": 1}
    tables = {"timing": "few", "sensitivity": ["few"], "ablation": ["few"], "also": [], "figures": figures}
    made = [f"study/docs/data/{name}.csv" for name in ("timing", "sensitivity", "ablation")]
    uncertainty = str(tiny.bundle.relative_to(tiny.folder) / "uncertainty.png")
    configs = write_study(tmp_path, sweeps={"few": sweep}, tables=tables)
    done = snakemake(copied, "--cores", "2", "study/results/sweeps/few.png", *made, uncertainty, configs=configs)
    assert "7 of 7 steps (100%) done" in done.stdout  # bundle, stills, orders, sweep, tables, uncertainty
    rows = read_rows(copied / "study/results/sweeps/few.csv")
    assert [(row["tau"], row["scene"], row["photos"]) for row in rows] == [(t, "desert", "7") for t in ("0.3", "0.6")]
    assert all(float(row[key]) > 0 for row in rows for key in ("psnr", "bundle_mb", "orders", "recon_s", "stills_s"))
    assert rows[0]["psnr"] == rows[1]["psnr"] and rows[0]["seam_lpips"] == ""
    assert (copied / "study/docs/data/sweep_few.csv").read_text().count("\n") == 3
    for path in ("study/results/sweeps/few.png", uncertainty):
        assert image_files.read_size(copied / path)[0] > 600


def test_a_finished_run_is_traded_off(snakemake, copied, tmp_path):
    """The settings are tau 0, 0.6 (the base) and 1 of the tiles that the tiny run made."""
    base = {"preset": "draft", "tiling": "semantic", "prior": "terrain"}
    configs = write_study(tmp_path, tradeoff={"scene": "desert", "base": base, "presets": ["draft"], "only": ["tau"]})
    page = "study/docs/results/tradeoff.md"
    done = snakemake(copied, "--cores", "2", "--scheduler", "greedy", page, configs=configs)
    assert "9 of 9 steps (100%) done" in done.stdout  # metrics, two bundles and their stills, orders of three, page
    rows = read_rows(copied / "study/results/tradeoff/tradeoff.csv")
    assert [row["setting"] for row in rows] == ["draft", "0", "0.6", "1"]
    assert all(float(row[key]) > 0 for row in rows for key in ("seconds", "own_seconds", "psnr", "bundle_mb"))
    assert "`draft` has the best PSNR for its time" in (copied / page).read_text()
    assert image_files.read_size(copied / "study/docs/figures/tradeoff_knobs.png")[0] > 300


def test_a_finished_run_has_figures_of_its_views(snakemake, copied):
    made = [f"{CELL}/{figure}_1.png" for figure in ("sphere", "evolution")]
    done = snakemake(copied, "--cores", "2", *made, configs=CONFIGS)
    assert "2 of 2 steps (100%) done" in done.stdout  # all they need is there
    for path in made:
        assert image_files.read_size(copied / path)[0] >= 1000 and image_files.read_photo(copied / path).std() > 0.05


def test_a_kit_is_made_answered_and_analysed(snakemake, copied):
    snakemake(copied, "--cores", "2", "perceptual_kit", configs=CONFIGS)
    home = copied / "study/results/forced_choice/kit"
    key = read_json(home / "key.json")
    assert (home / "page/index.html").is_file() and len(key["items"]) == 3  # two crops, and a check
    (copied / "answers").mkdir()
    for number in range(4):
        told = answer_files.answers(key, number, lambda item, number=number: item["check"] or number == 0)
        (copied / f"answers/2afc_{told['participant']}.json").write_text(json.dumps(told))
    snakemake(copied, "--cores", "1", "perceptual_results", configs=CONFIGS)
    every, desert = read_rows(copied / "study/results/tables/forced_choice.csv")
    assert (every["scene"], every["participants"], every["share"]) == ("every", "4", "0.25")
    assert float(every["low"]) < float(every["binomial_low"]) and desert["share"] == "0.25"
    (copied / "answers/zzz.json").write_text('{"format": "davgswt-2afc"}')
    done = snakemake(copied, "--cores", "1", "perceptual_results", configs=CONFIGS, check=False)
    assert done.returncode and "answers/zzz.json: " in done.stdout and "remove it" in done.stdout


def test_frames_of_the_page_are_timed(chromium, snakemake, copied):
    """The budgets that were asked for, and what the study's tables join; no time is asserted but that there is one."""
    snakemake(copied, "--cores", "2", "frame_times", configs=CONFIGS)
    rows = read_rows(copied / "study/results/tables/frames.csv")
    assert [r["budget"] for r in rows] == ["2000", "1000"]
    assert all(0 < float(r["splats"]) <= float(r["budget"]) and float(r["render_ms"]) > 0 for r in rows)
    (joined,) = spread.read_viewer(copied / "study/results/tables/viewer.csv")
    assert (joined["scene"], joined["tau"]) == ("desert", "0.6") and 0 < joined["update_share"] <= 1


def test_a_run_that_cannot_be_done_leaves_its_message(snakemake, tmp_path):
    snakemake(tmp_path, "--cores", "1", "study/results/stability/two-photos")
    found = json.loads((tmp_path / "study/results/stability/two-photos/outcome.json").read_text())
    assert found["exit_code"] == 1 and not found["traceback"]
    assert found["message"].startswith("config: scenes.desert.photo_count: input should be greater than or equal to 3")
