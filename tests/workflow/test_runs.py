"""The smallest experiment, run through every stage: what is there, what it looks like, what a change makes anew."""

import csv
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import yaml
from fixtures.runs import TINY, USUAL
from jsonschema import Draft202012Validator

from dav_gswt.field import read_field
from dav_gswt.files import digest_files, read_json
from dav_gswt.images import image_files
from dav_gswt.photos.colmap_model import read_colmap_model
from dav_gswt.reconstruction import ground
from dav_gswt.study.tables import spread
from dav_gswt.terrain.stills import SHOTS
from dav_gswt.views import pose_maps, scores

CONFIGS = (USUAL, TINY)
RULES = {
    "photos": ["render_photos", "report_photos", "split_views"],
    "coarse": ["fit_coarse", "evaluate_coarse", "score_coarse"],
    "active": ["select_poses", "capture_views", "update_field", "score_round", "evaluate_round"],
    "levels": ["make_levels"],
    "tiles": ["cut_tiles", "bundle_tiles"],
    "terrain": ["make_page", "render_terrain", "make_contact_sheet"],
}
AFTER_TAU = {"bundle_tiles", "make_page", "render_terrain", "make_contact_sheet", "all"}
BEFORE_K = {*RULES["photos"], *RULES["coarse"]}


@pytest.fixture(scope="module")
def tiny_config(root):
    return yaml.safe_load((root / TINY).read_text())


def test_photos_and_their_cameras_are_there(tiny, tiny_config):
    scene = tiny_config["scenes"]["desert"]
    known, frame = read_colmap_model(tiny.photos / "sparse"), read_json(tiny.photos / "ground.json")
    assert {p.name for p in (tiny.photos / "images").glob("[!.]*")} == set(known.names)
    assert len(known.names) == scene["photos"] + scene["test"] and len(frame["test"]) == scene["test"]
    for name in known.names:
        assert image_files.read_size(tiny.photos / "images" / name) == (scene["size"], scene["size"])


def test_no_photo_both_tests_and_is_fitted(tiny):
    views = read_json(tiny.start / "views.json")
    assert views["test"] and not set(views["test"]) & set(views["start"] + views["pool"])


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


def test_a_round_may_use_the_uncertainty_of_a_prior(snakemake, tiny, tmp_path):
    """From the tiny run's coarse field on: scored by the prior, chosen, captured, refitted, and to the finest level."""
    folder = shutil.copytree(tiny.folder, tmp_path / "run", symlinks=True)
    way = folder / "results/desert/seed0/draft/active_w2-lpips_terrain_pdrop0.15_lam0.1_k2/iter1"
    target = str((way / "levels").relative_to(folder))
    snakemake(folder, "--cores", "2", target, configs=(USUAL, TINY))
    first = scores.read_scores(folder / "results/desert/seed0/draft/coarse/scores_terrain_pdrop0.15/scores.csv")
    assert (first.term("w2_sq") > 0).all() and "lpips" not in first.terms and (first.steps == 2).all()
    chosen = [pose["name"] for pose in read_json(way / "poses.json")["poses"]]
    best = np.argsort(-first.term("w2_sq"), kind="stable")[:2]
    assert chosen == [first.names[i] for i in best]
    shown = image_files.read_exr_parts(way / "poses.exr")
    assert set(shown) == set(chosen)
    assert all(set(channels) == {"uncertainty", "w2_sq"} for channels, _ in shown.values())
    later = scores.read_scores(way / "scores.csv")
    assert later.scales == first.scales and not set(later.names) & set(chosen)
    uncertainty, level = pose_maps.read_pose_maps(way / "maps.npz")[1], read_field(way / "levels/level0.ply")
    assert len(uncertainty) == len(read_field(way / "field.ply"))
    top = level.ground & (level.uncertainty > 0)  # the underlay of a level has none
    assert top.any() and np.isin(level.uncertainty[top], uncertainty).all()
    assert not np.array_equal(level.uncertainty, read_field(tiny.round / "levels/level0.ply").uncertainty)


def test_a_policy_that_reads_the_prior_makes_the_same_bytes_on_any_number_of_threads(snakemake, tiny, tmp_path):
    branch = Path("results/desert/seed0/draft")
    way = branch / "active_w2-lpips_terrain_pdrop0.15_lam0.1_k2/iter1"
    made = []
    for threads in ("1", "2"):
        folder = shutil.copytree(tiny.folder, tmp_path / threads, symlinks=True)
        one = {"DAV_GSWT_THREADS": threads, "OMP_NUM_THREADS": threads}
        snakemake(folder, "--cores", threads, way / "scores.csv", configs=(USUAL, TINY), env=one)
        files = [p for part in (branch / "coarse", way) for p in sorted((folder / part).rglob("*")) if p.is_file()]
        made.append({p.relative_to(folder): digest_files(p) for p in files if not p.name.startswith(".")})
    assert {"scores.csv", "maps.npz", "poses.json", "field.ply"} <= {p.name for p in made[0]}
    assert made[0] == made[1]


def test_a_budget_ends_inside_a_round_and_later_rounds_hand_the_field_on(snakemake, tiny, tmp_path):
    """Five photos to start from, six in all: round 1 takes one instead of two, round 2 none."""
    folder = shutil.copytree(tiny.folder, tmp_path / "run", symlinks=True)
    branch = folder / "results/desert/seed0/draft/active_farthest_none_pdrop0_lam0_k2_upto6"
    first, then = branch / "iter1", branch / "iter2"
    targets = [str((r / "metrics.json").relative_to(folder)) for r in (first, then)]
    snakemake(folder, "--cores", "2", *targets, configs=(USUAL, TINY))
    for name in ("field.ply", "ground.exr"):
        assert digest_files(first / name) == digest_files(then / name) != digest_files(tiny.coarse / name)
    assert [len(read_json(r / "poses.json")["poses"]) for r in (first, then)] == [1, 0]
    assert read_json(then / "capture/capture.json")["shots"] == []
    before, after = read_json(first / "metrics.json"), read_json(then / "metrics.json")
    assert before["photos"] == after["photos"] == 6 and before["psnr"] == after["psnr"]
    assert before["stopped"] is None and after["stopped"] == "after 6 photos: 6 in all may be taken (stop.photos)"
    assert before["fit"]["earlier_views"]["photos"] == 5 and after["fit"]["new_views"]["photos"] == 0


def test_a_bundle_keeps_its_contract(tiny, root):
    bundle = read_json(tiny.bundle / "davgswt.json")
    Draft202012Validator(read_json(root / "workflow/schemas/davgswt.schema.json")).validate(bundle)
    chunks = [chunk for tile in bundle["tiles"] for chunk in tile["chunks"]]
    there = {f"chunks/{p.name}" for p in (tiny.bundle / "chunks").glob("[!.]*")}
    assert len(chunks) == 16 * len(bundle["levels"]) and {chunk["file"] for chunk in chunks} == there
    for chunk in chunks:
        path = tiny.bundle / chunk["file"]
        assert path.stat().st_size == chunk["bytes"] == chunk["count"] * (16 + 2 * len(chunk["orders"]))
        assert digest_files(path) == chunk["sha256"]
    source = bundle["provenance"]
    assert {"frame", "levels", "photos", "seams", "tiles"} == set(source["inputs"]) and "level0" in source["tiles"][
        "inputs"
    ]
    assert {"field", "ground"} == set(source["levels"]["inputs"]) and source["parameters"]["tau"] == 0.6


def test_a_round_s_photos_leave_as_a_model_of_what_it_saw(tiny, snakemake, tmp_path):
    folder = shutil.copytree(tiny.folder, tmp_path / "exported")
    target = tiny.round.relative_to(tiny.folder) / "exports/model"
    snakemake(folder, "--cores", "2", str(target), configs=CONFIGS)
    views, shots = read_json(tiny.start / "views.json"), read_json(tiny.round / "capture/capture.json")["shots"]
    known = read_colmap_model(folder / target / "sparse/0")
    assert set(known.names) == {*views["start"], *(shot["name"] for shot in shots)} and len(known.points)
    assert read_colmap_model(folder / target / "test/sparse/0").names == tuple(sorted(views["test"]))
    transforms = read_json(folder / target / "transforms.json")
    assert [Path(frame["file_path"]).name for frame in transforms["frames"]] == [
        *views["start"],
        *(shot["name"] for shot in shots),
    ]


def test_levels_leave_as_patches_for_other_viewers(tiny, snakemake, tmp_path):
    folder = shutil.copytree(tiny.folder, tmp_path / "exported")
    plys = tiny.bundle.relative_to(tiny.folder) / "exports/ply"
    snakemake(folder, "--cores", "2", str(plys), configs=CONFIGS)
    bundle = read_json(tiny.bundle / "davgswt.json")
    for level in range(len(bundle["levels"])):
        patch = read_field(folder / plys / f"level{level}.ply")
        assert len(patch) == sum(tile["chunks"][level]["count"] for tile in bundle["tiles"])
        east, down, north = np.ptp(patch.means, axis=0)
        assert (east, north) == pytest.approx((4 * bundle["tile_side"],) * 2, rel=0.2) and down < 0.5 * north


def test_a_finite_terrain_leaves_as_files_of_the_cells_asked_for(tiny, snakemake, tmp_path):
    folder = shutil.copytree(tiny.folder, tmp_path / "exported")
    target = tiny.bundle.relative_to(tiny.folder) / "exports/terrain"
    asked = "export={columns: 3, rows: 2, level: by_distance, formats: [ply, glb, 3dtiles]}"
    snakemake(folder, str(target), "--cores", "2", "--config", asked, configs=CONFIGS)
    facts = read_json(folder / target / "terrain.json")
    assert facts["cells"] == {"west": -1, "south": -1, "columns": 3, "rows": 2}
    assert facts["files"] == {"ply": "y-down", "glb": "y-up", "3dtiles": "z-up"}
    assert read_json(folder / target / "terrain_3dtiles/tileset.json")["asset"]["version"] == "1.1"
    assert len(read_field(folder / target / "terrain.ply")) == facts["gaussians"]
    small = ("--cores", "2", "--config", "export={max_gb: 0.0001}")
    refused = snakemake(folder, str(target), *small, configs=CONFIGS, check=False)
    assert refused.returncode and "export: glb: 8 x 8 cells have up to" in refused.stdout
    assert not list((folder / target).parent.glob(".terrain*"))


def test_the_ground_leaves_as_a_mesh_images_and_a_model(tiny, snakemake, tmp_path):
    folder = shutil.copytree(tiny.folder, tmp_path / "exported")
    target = tiny.bundle.relative_to(tiny.folder) / "exports/ground"
    asked = (
        "--config",
        "export={columns: 2, rows: 3, mesh_error: 0.5}",
        "heights={kind: hills, height: 1, wavelength: 9}",
    )
    snakemake(folder, str(target), "--cores", "2", *asked, configs=CONFIGS)
    facts = read_json(folder / target / "ground.json")
    side = read_json(tiny.bundle / "davgswt.json")["tile_side"]
    assert facts["cells"] == {"west": -1, "south": -1, "columns": 2, "rows": 3} and facts["map"] is None
    assert facts["heights"]["step"] * (facts["heights"]["columns"] - 1) == pytest.approx(2 * side)
    assert facts["heights"]["png"]["white"] > facts["heights"]["png"]["black"]
    there = {path.name for path in (folder / target).iterdir() if not path.name.startswith(".")}
    made = {f"ground.{kind}" for kind in ("glb", "json", "png", "tif", "hfield", "xml")}
    assert there - {"objects.glb"} == made


@pytest.mark.parametrize("made", ["tiny", "finished", "beach"])
def test_the_public_renderers_checker_finds_no_fault(made, gswt_checker, request):
    archive = request.getfixturevalue(made).bundle / "gswt.zip"
    command = [sys.executable, gswt_checker, archive]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0 and " 0 faults" in done.stdout, done.stdout + done.stderr


@pytest.mark.parametrize("made", ["tiny", "finished", "beach"])
def test_stills_show_ground_without_holes(made, tiny_config, request):
    """Not black, not flat, no haze of one colour; and nothing darker than shade in a place that is lit."""
    terrain, size = request.getfixturevalue(made).terrain, tiny_config["stills"]
    for shot in SHOTS:
        still = image_files.read_photo(terrain / f"{shot.name}.png")
        assert still.shape == (size["height"], size["width"], 3)
        below = still[size["height"] // 2 :]
        assert 0.15 < below.mean() < 0.9 and below.std() > 0.01, shot.name
        assert (below.max(2) < 0.03).mean() < 0.01, shot.name


@pytest.mark.parametrize("made", ["tiny", "finished", "beach"])
def test_a_page_holds_all_that_it_needs(made, request):
    made = request.getfixturevalue(made)
    page = made.terrain / "page"
    for chunk in (made.bundle / "chunks").glob("[!.]*"):
        assert digest_files(page / "chunks" / chunk.name) == digest_files(chunk)
    assert {"index.html", "main.js", "davgswt.json"} <= {p.name for p in page.iterdir()}


def test_real_photos_find_their_places(beach, photo_sets):
    frame = read_json(beach.photos / "ground.json")
    given = len(list((photo_sets / "brighton_beach/images").glob("*.[jJ]*")))
    assert frame["kind"] == "photos" and frame["images"] == given
    assert frame["registered"] == given and not frame["left_out"]
    assert frame["verdict"]["grade"] == "good" and frame["focal"]["used"] == pytest.approx(frame["focal"]["exif"])


def test_a_replayed_round_takes_photos_of_the_pool(beach):
    views, shots = read_json(beach.start / "views.json"), read_json(beach.round / "capture/capture.json")["shots"]
    assert len(views["start"]) == 8 and {s["name"] for s in shots} <= set(views["pool"]) and len(shots) == 2


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


def test_a_second_run_plans_nothing(tiny, finished, planned):
    assert not planned(tiny.folder, configs=CONFIGS)
    assert not planned(finished.folder, "--config", "scene=finished", configs=CONFIGS)


def test_another_tau_makes_only_the_bundle_and_what_follows(tiny, planned):
    assert set(planned(tiny.folder, "--config", "tau=0.3", configs=CONFIGS)) == AFTER_TAU


def test_another_k_keeps_the_coarse_field_and_its_scores(tiny, planned, tmp_path):
    (tmp_path / "k.yaml").write_text("k: 3\n")  # in a file: --config takes no key of one letter
    plan = planned(tiny.folder, configs=(*CONFIGS, tmp_path / "k.yaml"))
    assert not BEFORE_K & set(plan) and plan["select_poses"] == plan["update_field"] == 1


def test_another_round_goes_on_from_the_last_one(tiny, planned):
    plan = planned(tiny.folder, "--config", "rounds=2", configs=CONFIGS)
    assert not BEFORE_K & set(plan) and plan["update_field"] == plan["evaluate_round"] == 1


@pytest.mark.parametrize(
    "change, made",
    [
        pytest.param(
            "stills: {width: 320, height: 180}",
            {"render_terrain", "make_contact_sheet", "make_page"},  # the page begins with a still
            id="another size",
        ),
        pytest.param(
            "heights: {kind: hills, height: 2, wavelength: 20}",
            {"render_terrain", "make_contact_sheet", "make_page"},
            id="another surface",
        ),
    ],
)
def test_another_look_makes_only_what_shows_it(tiny, planned, tmp_path, change, made):
    (tmp_path / "look.yaml").write_text(change + "\n")
    plan = planned(tiny.folder, configs=(*CONFIGS, tmp_path / "look.yaml"))
    assert set(plan) == made | {"all"}


def test_a_field_is_completed_beside_its_round_and_levels_go_on_from_it(tiny, snakemake, tmp_path):
    folder = tmp_path / "completed"
    shutil.copytree(tiny.folder, folder)
    made = tiny.round.relative_to(tiny.folder) / "inpainted_terrain"
    snakemake(folder, "--cores", "2", made / "metrics.json", made / "levels", configs=CONFIGS)
    facts, found = read_json(folder / made / "completion.json"), read_json(folder / made / "metrics.json")
    before, after = (read_field(path / "field.ply") for path in (tiny.round, folder / made))
    assert facts["painted"] <= facts["unseen"] < facts["cells"] and facts["changed"] == bool(after.imagined.any())
    assert facts["changed"] or digest_files(tiny.round / "field.ply") == digest_files(folder / made / "field.ply")
    assert digest_files(tiny.round / "ground.exr") == digest_files(folder / made / "ground.exr")
    known = ~after.imagined[: len(before)]
    assert (
        np.array_equal(before.sh[known], after[: len(before)].sh[known])
        and (after.uncertainty[after.imagined] == 1).all()
    )
    assert found["gaussians"]["imagined"] == after.imagined.sum() and found["all"]["before"]["psnr"] > 10
    level = read_field(folder / made / "levels/level0.ply")
    assert len(level) and level.imagined.any() <= after.imagined.any()


def test_what_the_page_s_shortcuts_cost_is_measured_and_drawn(tiny, snakemake, tmp_path):
    folder = shutil.copytree(tiny.folder, tmp_path / "measured")
    snakemake(folder, "--cores", "2", "presort_table", configs=CONFIGS)
    with (folder / "results/tables/presort.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 12 and {r["scene"] for r in rows} == {"desert"}
    assert all(float(r["psnr"] or "inf") > 25 for r in rows if r["shortcut"] != "levels")
    assert (folder / "results/figures/presort.png").stat().st_size > 5000


def test_frames_of_the_library_and_of_the_page_are_timed(tiny, chromium, snakemake, tmp_path):
    """The budgets that were asked for, and what the study's tables join; no time is asserted but that there is one."""
    folder = shutil.copytree(tiny.folder, tmp_path / "timed")
    snakemake(folder, "--cores", "2", "frame_times", configs=CONFIGS)
    with (folder / "results/tables/frames.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert [(r["renderer"], r["budget"]) for r in rows] == [
        (n, b) for n in ("library", "page") for b in ("2000", "1000")
    ]
    assert all(float(r["splats"]) > 0 and float(r["render_ms"]) > 0 for r in rows)
    # the page also brings the end of the ground nearer; the library stops at the coarsest level, here of two
    assert all(float(r["splats"]) <= float(r["budget"]) for r in rows if r["renderer"] == "page")
    (joined,) = spread.read_viewer(folder / "results/tables/viewer.csv")
    assert (joined["scene"], joined["tau"]) == ("desert", "0.6") and 0 < joined["update_share"] <= 1
    assert (folder / "docs/research/figures/frames.png").stat().st_size > 5000


def test_every_level_of_every_tile_is_measured(tiny, snakemake, tmp_path):
    folder = shutil.copytree(tiny.folder, tmp_path / "measured")
    snakemake(folder, "--cores", "2", "lod_table", configs=CONFIGS)
    with (folder / "results/tables/lod.csv").open() as file:
        rows = list(csv.DictReader(file))
    levels = len(read_json(tiny.bundle / "davgswt.json")["levels"])
    assert {(int(r["tile"]), int(r["level"])) for r in rows} == {(t, lv) for t in range(16) for lv in range(levels)}
    assert all(r["scene"] == "desert" and (r["oblique_db"] == "") == (r["level"] == "0") for r in rows)
    for tile in range(16):
        own = [r for r in rows if int(r["tile"]) == tile]
        assert [float(r["mean_scale"]) for r in own] == sorted(float(r["mean_scale"]) for r in own)
