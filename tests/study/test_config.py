import pytest

from dav_gswt.config.load import add_scene_files, check_config, read_config
from dav_gswt.errors import InputError
from dav_gswt.study.config import expand_study
from dav_gswt.study.config_reference import make_reference


@pytest.fixture(scope="module")
def config(root):
    files = [root / "config/config.yaml", root / "config/study.yaml"]
    return check_config(add_scene_files(read_config(files), root / "config/scenes"))


@pytest.mark.parametrize("more", ["paper.yaml", "development.yaml", "hundred_views.yaml", "test/config.yaml"])
def test_the_studies_that_come_with_the_project_are_valid(root, more):
    files = [root / "config" / file for file in ("config.yaml", "study.yaml", more)]
    assert expand_study(check_config(add_scene_files(read_config(files), root / "config/scenes")))["study"]["tables"]


def pool(scene="desert_pool", photos=20, **more):
    return {"sets": [{"title": "a", "scenes": [scene], "k": [4], "photos": photos} | more]}


@pytest.mark.parametrize(
    "table, change, message",
    [
        ("view_benchmark", {"baseline": "w2"}, "baseline: w2 is not among"),
        ("view_benchmark", pool("desert"), "desert is no scene with"),
        ("view_benchmark", pool(photos=11), "leave no round of 4"),
        ("view_benchmark", pool(preset="x"), "sets.0.preset: there is no 'x'"),
        ("seams", {"scenes": ["moon"]}, "study.seams.scenes: there is no 'moon'"),
        ("seams", {"baseline": "none", "tilings": ["colour"]}, "none is not among"),
        ("refine", {"prior": "moon"}, "study.refine.prior: moon"),
        ("forced_choice", {"pairs": [["floor", "colour"]]}, "name it second"),
    ],
)
def test_what_cannot_be_studied_is_refused(config, table, change, message):
    study = config["study"]
    with pytest.raises(InputError, match=message):
        expand_study(config | {"study": study | {table: study[table] | change}})


def test_the_reference_is_that_of_the_models(root):
    stale = [name for name, text in make_reference().items() if (root / name).read_text() != text]
    assert not stale, "run `make reference`"
