import pytest
from study_configs import check_flat, flat_config

from dav_gswt_study import experiments as settings


@pytest.fixture
def config():
    return flat_config()


def test_every_setting_is_an_entry_with_one_name_that_differs_in_one_key(config):
    names = [settings.name_entry("draft", "cap", value) for value in (7e4, 1.250, "auto")]
    assert names == ["draft-cap-70000", "draft-cap-1_25", "draft-cap-auto"]
    made = settings.add_entries(config)
    new = set(made["presets"]) - set(config["presets"])
    assert {"draft-fit_size-192", "draft-spacing-1_75", "draft-max_gaussians-70000"} < new
    for entry in new:
        below = made["presets"][entry.split("-")[0]]
        differing = {key for key, value in made["presets"][entry].items() if value != below.get(key)}
        assert len(differing) == 1 and f"-{differing.pop()}-" in entry
    assert made["priors"]["terrain-steps-16"]["steps"] == 16
    assert made["tilings"]["semantic-variants-1"]["candidates"] == config["tilings"]["semantic"]["candidates"]
    own = {"presets": "draft-fit_size-384", "priors": "terrain-steps-8", "tilings": "semantic-variants-2"}
    assert not [name for table, name in own.items() if name in made[table]]  # the base's own values
    check_flat(made)
    assert settings.add_entries(made) == made
    assert settings.find_test_size(made) == config["presets"]["reference"]["fit_size"]  # the largest


def test_the_base_of_a_knob_that_does_not_name_it_is_its_last(config):
    config["tradeoff"]["knobs"]["steps"]["values"] = [1000, 200]
    found = [(s.shown, s.most, s.base) for s in settings.list_settings(config) if s.knob == "steps"]
    assert found == [("1000", True, False), ("200", False, False), ("360", False, True)]
    # only the knobs that are asked for are turned
    config["tradeoff"]["only"] = ["tau"]
    check_flat(config)
    assert {s.knob for s in settings.list_settings(config)} == {settings.PRESET, "tau"}
    del config["tradeoff"]
    assert settings.add_entries(config) == config and settings.list_settings(config) == []
