import pytest
from study_configs import study_config

from dav_gswt.errors import InputError
from dav_gswt_study.config import expand_study


@pytest.fixture(scope="module")
def config():
    return study_config()


@pytest.mark.parametrize(
    "more",
    [
        ("study/paper.yaml",),
        ("study/development.yaml",),
        ("study/hundred_views.yaml",),
        ("config/test/config.yaml", "study/tests/config.yaml"),
    ],
)
def test_the_studies_that_come_with_the_project_are_valid(more):
    assert study_config(*more)["study"]["tables"]


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
        ("forced_choice", {"pairs": [["floor", "colour"]]}, "name it second"),
    ],
)
def test_what_cannot_be_studied_is_refused(config, table, change, message):
    study = config["study"]
    product = {key: value for key, value in config.items() if key != "study"}
    with pytest.raises(InputError, match=message):
        expand_study(product, study | {table: study[table] | change})
