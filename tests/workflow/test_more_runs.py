"""Further runs, from the tiny one on: a prior, a budget, exports, other presets, other backends, real photos."""

import shutil
from pathlib import Path

import numpy as np
import pytest
import yaml
from fixtures.runs import TINY, USUAL

from dav_gswt.field import read_field
from dav_gswt.files import digest_files, read_json
from dav_gswt.photos.colmap_model import read_colmap_model
from dav_gswt.reconstruction import ground
from dav_gswt.views import scores

pytestmark = pytest.mark.slow
CONFIGS = (USUAL, TINY)


def test_a_round_may_use_the_uncertainty_of_a_prior(snakemake, tiny, tmp_path):
    """From the tiny run's coarse field on: scored by the prior, chosen, captured, refitted, and to the finest level."""
    folder = shutil.copytree(tiny.folder, tmp_path / "run", symlinks=True)
    way = folder / "results/desert/seed0/draft/active_w2-lpips_terrain_pdrop0.15_lam0.1_k2/iter1"
    target = str((way / "levels").relative_to(folder))
    snakemake(folder, "--cores", "2", target, configs=(USUAL, TINY))
    first = scores.read_scores(folder / "results/desert/seed0/draft/coarse/scores_terrain_pdrop0.15/scores.csv")
    assert (first.term("w2_sq") > 0).all() and "lpips" not in first.terms
    chosen = [pose["name"] for pose in read_json(way / "poses.json")["poses"]]
    best = np.argsort(-first.term("w2_sq"), kind="stable")[:2]
    assert chosen == [first.names[i] for i in best]
    later = scores.read_scores(way / "scores.csv")
    assert later.scales == first.scales and not set(later.names) & set(chosen)
    uncertainty, level = scores.read_pose_maps(way / "maps.npz")[1], read_field(way / "levels/level0.ply")
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


def test_a_field_is_completed_beside_its_round_and_levels_go_on_from_it(tiny, snakemake, tmp_path):
    folder = tmp_path / "completed"
    shutil.copytree(tiny.folder, folder)
    made = tiny.round.relative_to(tiny.folder) / "inpainted_terrain"
    snakemake(folder, "--cores", "2", made / "levels", configs=CONFIGS)
    facts = read_json(folder / made / "completion.json")
    before, after = (read_field(path / "field.ply") for path in (tiny.round, folder / made))
    assert facts["painted"] <= facts["unseen"] < facts["cells"] and facts["changed"] == bool(after.imagined.any())
    assert facts["changed"] or digest_files(tiny.round / "field.ply") == digest_files(folder / made / "field.ply")
    assert digest_files(tiny.round / "ground.exr") == digest_files(folder / made / "ground.exr")
    known = ~after.imagined[: len(before)]
    assert (
        np.array_equal(before.sh[known], after[: len(before)].sh[known])
        and (after.uncertainty[after.imagined] == 1).all()
    )
    level = read_field(folder / made / "levels/level0.ply")
    assert len(level) and level.imagined.any() <= after.imagined.any()


def test_real_photos_find_their_places(beach, photo_sets):
    frame = read_json(beach.photos / "ground.json")
    given = len(list((photo_sets / "brighton_beach/images").glob("*.[jJ]*")))
    assert frame["kind"] == "photos" and frame["images"] == given
    assert frame["registered"] == given and not frame["left_out"]
    assert frame["verdict"]["grade"] == "good" and frame["focal"]["used"] == pytest.approx(frame["focal"]["exif"])


def test_a_replayed_round_takes_photos_of_the_pool(beach):
    views, shots = read_json(beach.start / "views.json"), read_json(beach.round / "capture/capture.json")["shots"]
    assert len(views["start"]) == 8 and {s["name"] for s in shots} <= set(views["pool"]) and len(shots) == 2


def test_a_run_leaves_for_other_programs(tiny, snakemake, tmp_path):
    """A model of the photos, a finite terrain, and the ground as mesh, images and model."""
    folder = shutil.copytree(tiny.folder, tmp_path / "exported")
    bundle, side = tiny.bundle.relative_to(tiny.folder), read_json(tiny.bundle / "davgswt.json")["tile_side"]
    model = tiny.round.relative_to(tiny.folder) / "exports/model"
    export = "export={columns: 3, rows: 2, level: 1, formats: [ply, glb, 3dtiles]}"
    targets = [str(model), *(str(bundle / f"exports/{name}") for name in ("terrain", "ground"))]
    snakemake(folder, *targets, "--cores", "2", "--config", export, configs=CONFIGS)

    views, shots = read_json(tiny.start / "views.json"), read_json(tiny.round / "capture/capture.json")["shots"]
    known = read_colmap_model(folder / model / "sparse/0")
    assert set(known.names) == {*views["start"], *(shot["name"] for shot in shots)} and len(known.points)
    assert read_colmap_model(folder / model / "test/sparse/0").names == tuple(sorted(views["test"]))

    facts = read_json(folder / bundle / "exports/terrain/terrain.json")
    assert facts["cells"] == {"west": -1, "south": -1, "columns": 3, "rows": 2}
    assert facts["files"] == {"ply": "y-down", "glb": "y-up", "3dtiles": "z-up"}
    assert len(read_field(folder / bundle / "exports/terrain/terrain.ply")) == facts["gaussians"]

    facts = read_json(folder / bundle / "exports/ground/ground.json")
    assert facts["heights"]["step"] * (facts["heights"]["columns"] - 1) == pytest.approx(3 * side)
    there = {path.name for path in (folder / bundle / "exports/ground").iterdir() if not path.name.startswith(".")}
    assert there - {"objects.glb"} == {f"ground.{kind}" for kind in ("glb", "json", "png", "hfield", "xml")}

    small = ("--cores", "2", "--config", "export={level: 9}")
    refused = snakemake(folder, targets[1], *small, configs=CONFIGS, check=False)
    assert refused.returncode and "export.level: there is no level 9" in refused.stdout


def test_another_preset_fits_the_photos_that_the_first_one_chose(tiny, snakemake, tmp_path):
    """The rounds of the tiny run stay: one fit to their photos, of another size, and what follows from it.

    Of windows, since materials are told apart: tiles are cut from them, and tests are measured in them, too.
    """
    folder, config = shutil.copytree(tiny.folder, tmp_path / "chosen"), tmp_path / "finer.yaml"
    preset = {
        "fit_size": 96,
        "spacing": 2.0,
        "max_gaussians": 9000,
        "steps": 40,
        "steps_per_photo": 10,
        "level_steps": 10,
    }
    entries = {
        "presets": {"finer": preset | {"choose_with": "draft"}},
        "scenes": {"desert": {"preset": "finer", "materials": "auto"}},
    }
    config.write_text(yaml.safe_dump(entries))
    own = tiny.round.relative_to(tiny.folder)
    made = Path(str(own).replace("/draft/", "/finer/"))
    page = made / tiny.terrain.relative_to(tiny.round) / "page"
    targets = [made / "metrics.json", page]
    done = snakemake(folder, "--cores", "2", *targets, configs=(*CONFIGS, config))
    assert "rule fit_windows" in done.stdout and "rule fit_coarse" not in done.stdout
    asked, chosen = (read_json(folder / path / "poses.json") for path in (own, made))
    assert chosen == asked | {"chosen_with": "draft"}
    taken = [digest_files(*sorted((folder / path / "capture").glob("[!.]*"))) for path in (own, made)]
    assert taken[0] == taken[1]
    found = read_json(folder / made / "metrics.json")
    assert found["photos"] == 7 and 20 < found["psnr"] < 60
    rounds = read_json(folder / page / "story.json")["rounds"]
    assert [one["psnr"] for one in rounds] == [None, round(found["windows"]["psnr"], 2)]
    assert read_json(folder / made / "windows/windows.json")["tiled"][0]
    width = read_json(folder / made / "materials/materials.json")["tile_side"]
    assert width * ground.read_ground(folder / made / "windows/window0.exr").spacing > 0


def test_torch_fits_the_coarse_field_as_well_as_the_core(snakemake, tiny, tmp_path):
    """The same photos, steps and seed; float32 sums in another order send the two fits slightly different ways."""
    folder = shutil.copytree(tiny.folder, tmp_path / "run")
    coarse = folder / tiny.coarse.relative_to(tiny.folder)
    shutil.rmtree(coarse)
    wanted = str((coarse / "metrics.json").relative_to(folder))
    snakemake(folder, "--cores", "2", wanted, configs=CONFIGS, env={"DAV_GSWT_BACKEND": "torch"})
    found, core = read_json(coarse / "metrics.json"), read_json(tiny.coarse / "metrics.json")
    assert found["provenance"]["renderer"]["backend"] == "torch"
    assert found["psnr"] == pytest.approx(core["psnr"], abs=0.5)
