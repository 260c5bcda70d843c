import pytest
from study_configs import study_config


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
