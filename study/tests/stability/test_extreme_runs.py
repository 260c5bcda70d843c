from dataclasses import replace

import numpy as np
from fixtures import bundles

from dav_gswt.bundle import manifest, store
from dav_gswt.config import load
from dav_gswt.errors import InputError
from dav_gswt.field import write_field
from dav_gswt.files import write_json
from dav_gswt.images import image_files
from dav_gswt_study.stability import running
from dav_gswt_study.stability.extremes import ALL, EXTREMES, make_ground_field

FILES = [running.DEFAULT_CONFIG, running.TEST_CONFIG]
WELL = {"exit_code": 0, "message": None, "traceback": False, "not_finite": 0, "blank_stills": 0, "stills_psnr": None}


def test_what_is_laid_over_the_config_is_what_the_config_allows_or_says(root):
    for extreme in ALL:
        given = load.read_config([root / file for file in FILES], extreme.overrides)
        try:
            load.check_config(load.add_scene_files(given, root / "config/scenes"))
        except InputError as error:
            said = WELL | {"exit_code": 1, "message": str(error)}
            assert extreme.error_pattern and running.has_failed_as_expected(extreme, said), extreme.name


def test_a_number_that_is_not_finite_is_found_in_a_table_in_a_field_and_in_a_bundle(tmp_path, monkeypatch):
    path = tmp_path / "a.csv"
    for word, finite in (("infinite", True), ("nan", False), ("-inf", False)):
        path.write_text(f"name,value\nx,1.5\ny,{word}\n")
        assert running.is_finite(path) == finite
    for value in (0.5, np.nan):
        given = make_ground_field(3, 1.0)
        given.means[4, 1] = value
        write_field(given, tmp_path / "a.ply")
        assert running.is_finite(tmp_path / "a.ply") == np.isfinite(value)
    bundles.write_bundle(tmp_path / "bundle", bundles.Ground(discs=2, levels=1))
    path, read = tmp_path / "bundle/davgswt.json", manifest.read_manifest(tmp_path / "bundle")
    beyond = replace(read, encoding=replace(read.encoding, log_scale=[1000.0, 1.0]))  # its exponential is no number
    for value, finite in ((read, True), (beyond, False)):
        monkeypatch.setattr(store, "read_manifest", lambda folder, value=value: value)
        assert running.is_finite(path) == finite


def test_a_row_tells_whether_a_world_looks_as_one_of_another_size(tmp_path):
    def tabulate(picture, name="world-1e6", not_finite=()):
        (tmp_path / name).mkdir(exist_ok=True)
        for still in running.NEAR_STILLS:
            image_files.write_png(tmp_path / name / f"{still}.png", picture)
        found = WELL | {"name": name, "warnings": [], "checked": 3, "not_finite": list(not_finite)}
        write_json(tmp_path / name / "outcome.json", found | {"gaussians": 9, "seconds": 1.0, "peak_mb": 2.0})
        return running.tabulate_run(EXTREMES[name], tmp_path)

    picture = np.random.default_rng(0).uniform(0, 1, (20, 30, 3)).astype(np.float32)
    tabulate(picture, "world-1")
    assert (row := tabulate(picture))["as_expected"] and row["stills_psnr"] == 100
    assert not tabulate(picture[::-1].copy())["as_expected"]
    assert tabulate(np.full_like(picture, 0.4))["blank_stills"] == 2
    assert not tabulate(picture, not_finite=["a.ply"])["as_expected"]
