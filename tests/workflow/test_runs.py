"""The smallest experiment, run through every stage: what is there, what it looks like, what a change makes again."""

import json
import subprocess
import sys

import numpy as np
import pytest
import yaml
from fixtures.browser import served
from fixtures.page_visit import Visit
from fixtures.runs import TINY, USUAL
from jsonschema import Draft202012Validator

from dav_gswt.bundle.store import read_bundle
from dav_gswt.export import gswt
from dav_gswt.field import read_field
from dav_gswt.files import digest_files, read_json
from dav_gswt.images import image_files
from dav_gswt.photos.colmap_model import read_colmap_model
from dav_gswt.reconstruction import ground
from dav_gswt.terrain.stills import SHOTS

CONFIGS = (USUAL, TINY)
ENOUGH = 150_000  # Gaussians of a picture that has few pixels; software draws it
RULES = {
    "photos": ["render_photos", "report_photos", "split_views"],
    "coarse": ["fit_coarse", "evaluate_coarse", "score_coarse"],
    "active": ["select_poses", "capture_views", "update_field", "score_round", "evaluate_round"],
    "levels": ["make_levels"],
    "tiles": ["cut_tiles", "bundle_tiles"],
    "terrain": ["make_page", "render_terrain", "make_contact_sheet"],
}
LOOK = {"make_page", "render_terrain", "make_contact_sheet"}
TILES = {"cut_tiles", "bundle_tiles"} | LOOK
LEVELS = {"make_levels"} | TILES
LAST_ROUND = {"select_poses", "capture_views", "update_field", "score_round", "evaluate_round"}
FIT = {"fit_coarse", "evaluate_coarse", "score_coarse"} | LAST_ROUND
TABLE = [  # changed keys, and the rules that must run again on a finished run of the synthetic scene
    ({"stills": [320, 180]}, LOOK),
    ({"heights": {"kind": "hills", "height": 2, "wavelength": 20}}, LOOK),
    ({"tau": 0.3}, {"bundle_tiles"} | LOOK),
    ({"tilings": {"semantic": {"candidates": 25}}}, TILES),
    ({"levels": 2, "presets": {"draft": {"level_steps": 11}}}, LEVELS),
    ({"k": 3}, LAST_ROUND | LEVELS),
    ({"presets": {"draft": {"steps": 61}}}, FIT | LEVELS),
    ({"seeds": [1]}, {"split_views"} | FIT | LEVELS),
    ({"scenes": {"desert": {"seed": 101}}}, {"render_photos", "report_photos", "split_views"} | FIT | LEVELS),
    ({"scenes": {"planet": {"seed": 7}}, "priors": {"terrain": {"samples": 3}}}, set()),
]


@pytest.fixture(
    params=[
        "tiny",
        pytest.param("finished", marks=pytest.mark.slow),
        pytest.param("beach", marks=pytest.mark.slow),
    ]
)
def made(request):
    """A finished run: a synthetic scene, a finished field, real photos."""
    return request.getfixturevalue(request.param)


@pytest.fixture(scope="module")
def tiny_config(root):
    return yaml.safe_load((root / TINY).read_text())


def test_photos_and_their_cameras_are_there(tiny, tiny_config):
    scene = tiny_config["scenes"]["desert"]
    known, frame = read_colmap_model(tiny.photos / "sparse"), read_json(tiny.photos / "ground.json")
    assert {p.name for p in (tiny.photos / "images").glob("[!.]*")} == set(known.names)
    assert len(known.names) == scene["photo_count"] + scene["test"] and len(frame["test"]) == scene["test"]
    for name in known.names:
        assert image_files.read_size(tiny.photos / "images" / name) == (scene["size"], scene["size"])


def test_fields_lie_on_their_grids(tiny):
    """One disc a cell, first and in the grid's order: what levels and tiles rest on."""
    levels = [(tiny.round / f"levels/level{level}.ply", tiny.round / f"levels/level{level}.exr") for level in (0, 1)]
    pairs = [(stage / "field.ply", stage / "ground.exr") for stage in (tiny.coarse, tiny.round)]
    for path, grid_path in pairs + levels:
        fitted, grid = read_field(path), ground.read_ground(grid_path)
        cells = grid.shape[0] * grid.shape[1]
        assert fitted.ground[:cells].all() and not fitted.ground[cells:].any()
        assert (
            np.abs(fitted.means[:cells, :2] - grid.centres[:, :2]).max() <= 0.51 * grid.spacing
        )  # float32 at cell edges


def test_the_round_adds_the_photos_that_were_asked_for(tiny, tiny_config):
    asked = read_json(tiny.round / "poses.json")["poses"]
    shots = read_json(tiny.round / "capture/capture.json")["shots"]
    assert len(asked) == len(shots) == tiny_config["k"]
    before, after = read_json(tiny.coarse / "metrics.json"), read_json(tiny.round / "metrics.json")
    assert after["photos"] == before["photos"] + len(shots) and (before["round"], after["round"]) == (0, 1)


def test_metrics_are_those_of_a_picture_of_the_place(tiny):
    for stage in (tiny.coarse, tiny.round):
        found = read_json(stage / "metrics.json")
        for row in [found, *found["test_views"]]:
            # A plain sand-coloured picture of this desert reaches 20 dB.
            assert 20 < row["psnr"] < 60 and 0.3 < row["ssim"] <= 1


def test_uncertainty_lies_between_0_and_1(tiny):
    for stage in (tiny.coarse / "scores_none_pdrop0", tiny.round):
        for channels, _ in image_files.read_exr_parts(stage / "uncertainty.exr").values():
            for values in channels.values():
                seen = values[np.isfinite(values)]
                assert len(seen) and seen.min() >= 0 and seen.max() <= 1
    assert 0 <= read_field(tiny.round / "field.ply").uncertainty.min() <= 1


def test_a_bundle_keeps_its_contract(tiny, root):
    bundle = read_json(tiny.bundle / "davgswt.json")
    Draft202012Validator(read_json(root / "workflow/schemas/davgswt.schema.json")).validate(bundle)
    assert all(len(tile["chunks"]) == len(bundle["levels"]) for tile in bundle["tiles"]) and len(bundle["tiles"]) == 16
    there = {f"parts/{p.name}" for p in (tiny.bundle / "parts").glob("[!.]*")}
    assert {part["file"] for part in bundle["parts"]} == there
    assert {part["kind"] for part in bundle["parts"]} >= {"recipes", "level"}
    for part in bundle["parts"]:
        path = tiny.bundle / part["file"]
        assert path.stat().st_size == part["bytes"] and digest_files(path) == part["sha256"]
    assert {p.name for p in tiny.bundle.iterdir()} == {"davgswt.json", "parts", "terrain"}, "all else is on request"
    source = bundle["provenance"]
    assert {"frame", "levels", "photos", "seams", "tiles"} == set(source["inputs"]) and "level0" in source["tiles"][
        "inputs"
    ]
    assert {"field", "ground"} == set(source["levels"]["inputs"]) and source["parameters"]["tau"] == 0.6


def test_every_rule_left_its_log_and_its_benchmark(tiny):
    logs = sorted(p.stem for p in (tiny.folder / "results/logs").rglob("*.log"))
    benchmarks = sorted((tiny.folder / "results/benchmarks").rglob("*.tsv"))
    assert logs == [p.stem for p in sorted(benchmarks, key=lambda p: p.stem)] == sorted(sum(RULES.values(), []))
    for path in benchmarks:
        names, values = (line.split("\t") for line in path.read_text().splitlines())
        assert float(values[names.index("s")]) > 0


def test_nothing_but_results_is_written(tiny):
    assert {p.name for p in tiny.folder.iterdir()} == {"results", ".snakemake"}
    assert not [p for p in (tiny.folder / "results").rglob("*") if p.name.startswith(".") and ".part" in p.name]


def test_stills_show_ground_without_holes(made, tiny_config):
    """Not black, not flat, no haze of one colour; and nothing darker than shade in a place that is lit."""
    width, height = tiny_config["stills"]
    for shot in SHOTS:
        still = image_files.read_photo(made.terrain / f"{shot.name}.png")
        assert still.shape == (height, width, 3)
        below = still[height // 2 :]
        assert 0.15 < below.mean() < 0.9 and below.std() > 0.01, shot.name
        assert (below.max(2) < 0.03).mean() < 0.01, shot.name


def test_a_page_holds_all_that_it_needs(made):
    page = made.terrain / "page"
    for part in (made.bundle / "parts").glob("[!.]*"):
        assert digest_files(page / "parts" / part.name) == digest_files(part)
    assert {"index.html", "main.js", "davgswt.json"} <= {p.name for p in page.iterdir()}


def test_a_page_shows_its_ground(made, chromium):
    page = chromium.new_context(viewport={"width": 160, "height": 100}).new_page()
    complaints = []
    page.on("console", lambda said: complaints.append(said.text) if said.type == "error" else None)
    page.on("pageerror", lambda error: complaints.append(str(error)))
    with served(made.terrain / "page") as address:
        picture = Visit(page).open(f"{address}?still=1000").picture(ENOUGH)
    below = picture[picture.shape[0] // 2 :]
    assert not complaints and page.locator("#error").is_hidden()
    assert below.mean() > 40 and below.std() > 2
    assert (below.max(2) < 8).mean() < 0.01


def test_the_public_renderers_checker_finds_no_fault(made, gswt_checker, tmp_path):
    gswt.export_archive(read_bundle(made.bundle), tmp_path / "gswt.zip")
    command = [sys.executable, gswt_checker, tmp_path / "gswt.zip"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0 and " 0 faults" in done.stdout, done.stdout + done.stderr


@pytest.mark.parametrize("change, rules", TABLE, ids=[json.dumps(change) for change, _ in TABLE])
def test_a_changed_key_makes_again_what_reads_it(tiny, planned, tmp_path, change, rules):
    (tmp_path / "change.json").write_text(json.dumps(change))
    plan = planned(tiny.folder, configs=(*CONFIGS, tmp_path / "change.json"))
    assert set(plan) - {"all"} == rules


def test_a_second_run_plans_nothing(tiny, planned):
    assert not planned(tiny.folder, configs=CONFIGS)


def test_another_round_goes_on_from_the_last_one(tiny, planned):
    plan = planned(tiny.folder, "--config", "rounds=2", configs=CONFIGS)
    assert not {"fit_coarse", "score_coarse"} & set(plan) and plan["update_field"] == plan["evaluate_round"] == 1
