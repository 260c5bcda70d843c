"""Extreme runs: their overrides are valid, and the outcome of a run is described rightly."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from dav_gswt.bundle import chunks
from dav_gswt.bundle.encoding import Encoding
from dav_gswt.config import load
from dav_gswt.errors import InputError
from dav_gswt.field import write_field
from dav_gswt.files import write_json
from dav_gswt.images import image_files
from dav_gswt.study.stability import extremes, running, tables
from dav_gswt.study.stability.extremes import ALL, EXTREMES, make_ground_field

FILES = [running.DEFAULT_CONFIG, "config/study.yaml", running.TEST_CONFIG]


@pytest.mark.parametrize("extreme", ALL, ids=lambda extreme: extreme.name)
def test_what_is_laid_over_the_config_is_what_the_config_allows_or_says(root, extreme):
    given = load.read_config([root / file for file in FILES], extreme.overrides)
    try:
        load.check_config(load.add_scene_files(given, root / "config/scenes"))
    except InputError as error:
        assert extreme.error_pattern and tables.has_failed_as_expected(
            extreme, outcome(exit_code=1, message=str(error))
        )


def test_worlds_differ_in_size_alone():
    small, large = make_ground_field(12, 1e-2), make_ground_field(12, 1e7)
    np.testing.assert_allclose(large.means, 1e9 * small.means.astype(float), rtol=1e-6)
    np.testing.assert_allclose(large.log_scales - small.log_scales, np.log(1e9), rtol=1e-6)
    np.testing.assert_array_equal(large.sh, small.sh)


def outcome(**more):
    usual = {"exit_code": 0, "message": None, "traceback": False, "not_finite": 0, "blank_stills": 0}
    return usual | {"stills_psnr": None} | more


@pytest.mark.parametrize(
    "fault", [dict(exit_code=1), dict(traceback=True), dict(not_finite=2), dict(blank_stills=1), dict(stills_psnr=20.0)]
)
def test_a_run_ends_well_only_without_any_fault(fault):
    assert tables.has_finished(EXTREMES["tau-0"], outcome())
    assert not tables.has_finished(EXTREMES["tau-0"], outcome(**fault))


def test_a_run_fails_well_only_with_its_own_message_and_no_traceback():
    extreme = EXTREMES["one-gaussian"]
    right = outcome(exit_code=1, message="finished.ply: the field has 1 opaque Gaussians; a surface")
    assert tables.has_failed_as_expected(extreme, right)
    for fault in (dict(exit_code=0), dict(message="another"), dict(message=None), dict(traceback=True)):
        assert not tables.has_failed_as_expected(extreme, right | fault)


def test_the_message_is_what_a_user_reads_last():
    output = """Using workflow specific profile profiles/default for setting default command line arguments.
1 jobs to do
[1 of 1] import_field
  finished.ply: there is nothing in it
import_field is not finished; its log: results/logs/finished/photos/import_field.log
"""
    assert running.extract_message(output) == "finished.ply: there is nothing in it"


def test_the_message_of_a_wrong_config_is_its_line():
    assert running.extract_message("config: k: 0 is too few\n") == "config: k: 0 is too few"


@pytest.mark.parametrize("bad", ["nan", "inf", "-inf", "NaN"])
def test_a_number_that_is_not_finite_is_found_in_a_table(tmp_path, bad):
    path = tmp_path / "a.csv"
    path.write_text("name,value\ninfinite,1.5\n")
    assert running.is_finite(path)
    path.write_text(f"name,value\nx,1.5\ny,{bad}\n")
    assert not running.is_finite(path)


def test_a_number_that_is_not_finite_is_found_in_a_field(tmp_path):
    given, path = make_ground_field(3, 1.0), tmp_path / "a.ply"
    write_field(given, path)
    assert running.is_finite(path)
    given.means[4, 1] = np.nan
    write_field(given, path)
    assert not running.is_finite(path)


def test_a_number_that_is_not_finite_is_found_in_a_chunk(tmp_path):
    given, path = make_ground_field(3, 1.0), tmp_path / "chunks/lod0_tile_00.bin"
    path.parent.mkdir()
    code = Encoding.fit([given], 1.0, 0.01)
    kept = chunks.ChunkOrders(0, [0])
    rows, order = code.encode(given), np.arange(len(given))[None]
    entry = chunks.write_chunk(rows, order, tmp_path, "chunks/lod0_tile_00.bin", kept)
    tiles = [{"chunks": [vars(entry)]}]
    write_json(tmp_path / "davgswt.json", {"tiles": tiles, "encoding": vars(code)})
    assert running.is_finite(path)
    beyond = replace(code, log_scale=[1000.0, 1.0])  # the exponential of it is no number
    write_json(tmp_path / "davgswt.json", {"tiles": tiles, "encoding": vars(beyond)})
    assert not running.is_finite(path)


def write_run(folder: Path, name: str, picture, **more) -> None:
    for still in tables.NEAR_STILLS:
        image_files.write_png(folder / name / f"{still}.png", picture)
    found = {"name": name, "exit_code": 0, "message": None, "traceback": False, "warnings": [], "checked": 3}
    found |= {"not_finite": [], "gaussians": 9, "seconds": 1.0, "peak_mb": 2.0}
    write_json(folder / name / "outcome.json", found | more)


def test_a_row_tells_whether_a_world_looks_as_one_of_another_size(tmp_path):
    picture = np.random.default_rng(0).uniform(0, 1, (20, 30, 3)).astype(np.float32)
    for name in ("world-1", "world-1e6"):
        (tmp_path / name).mkdir()
        write_run(tmp_path, name, picture)
    extreme = EXTREMES["world-1e6"]
    assert (row := tables.tabulate_run(extreme, tmp_path))["as_expected"] and row["stills_psnr"] == 100
    write_run(tmp_path, "world-1e6", picture[::-1].copy())
    assert not tables.tabulate_run(extreme, tmp_path)["as_expected"]
    write_run(tmp_path, "world-1e6", np.full_like(picture, 0.4))
    assert tables.tabulate_run(extreme, tmp_path)["blank_stills"] == 2
    write_run(tmp_path, "world-1e6", picture, not_finite=["a.ply"])
    assert not tables.tabulate_run(extreme, tmp_path)["as_expected"]


def test_names_of_extremes_are_names_of_folders():
    assert all(name == name.strip("/. ") and "/" not in name for name in EXTREMES)
    assert {extreme.same_as for extreme in extremes.ALL if extreme.same_as} <= set(EXTREMES)
