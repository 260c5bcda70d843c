"""The study's part of the config, against the product's."""

from pathlib import Path

import pytest

from dav_gswt.config.load import add_scene_files, check_config, read_config
from dav_gswt.errors import InputError
from dav_gswt.study.config import expand_study


@pytest.fixture(scope="module")
def config(root):
    files = [root / "config/config.yaml", root / "config/study.yaml"]
    return check_config(add_scene_files(read_config(files), root / "config/scenes"))


def expand(config: dict, table: str, change: dict) -> dict:
    study = config["study"]
    return expand_study(config | {"study": study | {table: study[table] | change}})


@pytest.mark.parametrize(
    "more",
    [
        [],
        ["config/paper.yaml"],
        ["config/development.yaml"],
        ["config/hundred_views.yaml"],
        ["config/test/config.yaml"],
    ],
)
def test_the_studies_that_come_with_the_project_are_valid(root: Path, more):
    files = [root / file for file in ("config/config.yaml", "config/study.yaml", *more)]
    assert expand_study(check_config(add_scene_files(read_config(files), root / "config/scenes")))["study"]["tables"]


def test_settings_of_knobs_become_presets(config):
    made = expand_study(config)["presets"]
    assert made["draft-max_gaussians-70000"] == made["draft"] | {"max_gaussians": 70000}


@pytest.mark.parametrize(
    "table, change, message",
    [
        pytest.param("view_benchmark", {"baseline": "w2"}, "baseline: w2 is not among", id="baseline not run"),
        pytest.param(
            "view_benchmark",
            {"sets": [{"title": "a", "scenes": ["desert"], "k": [4], "photos": 20}]},
            "desert is no scene with",
            id="no pool",
        ),
        pytest.param(
            "view_benchmark", {"policies": ["farthest", {"policy": "w2", "prior": "x"}]}, "no 'x'", id="no such prior"
        ),
        pytest.param(
            "view_benchmark",
            {"sets": [{"title": "a", "scenes": ["moon"], "k": [4], "photos": 20}]},
            "moon is no scene",
            id="no scene",
        ),
        pytest.param(
            "view_benchmark",
            {"sets": [{"title": "a", "scenes": ["desert_pool"], "k": [4], "photos": 11}]},
            "leave no round of 4",
            id="no room",
        ),
        pytest.param(
            "view_benchmark",
            {"sets": [{"title": "a", "scenes": ["desert_pool"], "k": [4], "photos": 20, "preset": "x"}]},
            "sets.0.preset: there is no 'x'",
            id="no such preset",
        ),
        pytest.param("seams", {"scenes": ["moon"]}, "study.seams.scenes: there is no 'moon'", id="no such scene"),
        pytest.param("seams", {"tilings": ["glue", "colour"]}, "there is no 'glue'", id="no such tiling"),
        pytest.param("seams", {"baseline": "none", "tilings": ["colour"]}, "none is not among", id="baseline not cut"),
        pytest.param("seams", {"tilings": []}, "study.seams.tilings", id="nothing to compare"),
        pytest.param("seams", {"replicates": 0}, "study.seams.replicates", id="no tiles"),
        pytest.param("seams", {"scenes": "desert"}, "study.seams.scenes", id="a name where a list belongs"),
        pytest.param("seams", {"draws": 3}, "'draws' is called 'replicates' now", id="a renamed key"),
        pytest.param("refine", {"prior": "moon"}, "study.refine.prior: moon", id="refined by no prior"),
        pytest.param("refine", {"strength": 2}, "study.refine.strength", id="more than noise"),
        pytest.param("forced_choice", {"pairs": [["floor", "colour"]]}, "name it second", id="the floor first"),
    ],
)
def test_what_cannot_be_studied_is_refused(config, table, change, message):
    with pytest.raises(InputError, match=message):
        expand(config, table, change)
