"""Settings as named entries: one spelling, in range, nothing twice, and what makes no sense is named."""

from copy import deepcopy

import pytest
from fixtures.configs import check_flat, flat_config

from dav_gswt.errors import InputError
from dav_gswt.study.tradeoff import settings


@pytest.fixture
def config():
    return flat_config()


@pytest.mark.parametrize(
    "value, spelled",
    [
        (70000, "reference-max_gaussians-70000"),
        (70000.0, "reference-max_gaussians-70000"),
        (7e4, "reference-max_gaussians-70000"),
        (1.25, "reference-max_gaussians-1_25"),
        (1.250, "reference-max_gaussians-1_25"),
        (0.5, "reference-max_gaussians-0_5"),
        ("auto", "reference-max_gaussians-auto"),
    ],
)
def test_a_setting_has_one_name(value, spelled):
    assert settings.name_entry("reference", "max_gaussians", value) == spelled


def test_every_setting_is_an_entry_that_differs_in_one_key(config):
    made = settings.add_entries(config)
    new = set(made["presets"]) - set(config["presets"])
    assert {"draft-size-192", "draft-spacing-1_75", "draft-max_gaussians-auto"} < new
    for entry in new:
        below = made["presets"][entry.split("-")[0]]
        differing = {key for key, value in made["presets"][entry].items() if value != below.get(key)}
        assert len(differing) == 1 and f"-{differing.pop()}-" in entry
    assert made["priors"]["terrain-steps-16"]["steps"] == 16
    assert made["tilings"]["semantic-variants-1"]["candidates"] == config["tilings"]["semantic"]["candidates"]
    for table, own in (
        ("presets", "draft-size-384"),
        ("priors", "terrain-steps-8"),
        ("tilings", "semantic-variants-2"),
    ):
        assert own not in made[table]  # the base's own values


def test_the_entries_are_valid_and_making_them_again_changes_nothing(config):
    made = settings.add_entries(config)
    check_flat(made)
    assert settings.add_entries(made) == made
    assert all(len(made[table]) > len(config[table]) for table in settings.CALLED)


def test_a_config_that_compares_nothing_stays_as_it_is(config):
    del config["tradeoff"]
    assert settings.add_entries(config) == config and settings.list_settings(config) == []


def test_each_knob_has_a_most_accurate_and_a_base_and_no_setting_comes_twice(config):
    found = settings.list_settings(config)
    knobs = [settings.PRESET, *config["tradeoff"]["knobs"]]
    assert list(dict.fromkeys(s.knob for s in found)) == knobs
    for knob in knobs:
        mine = [s for s in found if s.knob == knob]
        assert [s.most for s in mine] == [True] + [False] * (len(mine) - 1)
        assert sum(s.base for s in mine) == 1
        assert len({s.shown for s in mine}) == len(mine)
    assert [(s.shown, s.chosen["preset"], s.base) for s in found if s.knob == "steps"] == [
        ("1000", "draft-steps-1000", False),
        ("360", "draft", True),
        ("180", "draft-steps-180", False),
        ("auto", "draft-steps-auto", False),
    ]
    assert {s.chosen["policy"] for s in found if s.knob == "denoising"} == {"coverage-w2"}
    assert [s.chosen["tau"] for s in found if s.knob == "tau"] == [0, 0.6, 1]


def test_the_base_of_a_knob_that_does_not_name_it_is_its_last(config):
    config["tradeoff"]["knobs"]["steps"]["values"] = [1000, 200]
    found = [(s.shown, s.most, s.base) for s in settings.list_settings(config) if s.knob == "steps"]
    assert found == [("1000", True, False), ("200", False, False), ("360", False, True)]


def test_a_key_that_an_entry_leaves_out_has_a_name_too(config):
    config["tradeoff"]["knobs"] = {"levels": {"of": "presets", "values": ["auto", 4], "measure": "stills"}}
    found = [(s.shown, s.base) for s in settings.list_settings(config) if s.knob == "levels"]
    assert found == [("auto", True), ("4", False)]


def test_all_are_tested_on_photos_of_the_largest_size(config):
    assert settings.find_test_size(settings.add_entries(config)) == config["presets"]["reference"]["size"]
    config["tradeoff"]["presets"] = ["draft"]
    config["tradeoff"]["knobs"]["size"]["values"] = [500, 100]
    assert settings.find_test_size(settings.add_entries(config)) == 500


def test_only_the_knobs_that_are_asked_for_are_turned(config):
    config["tradeoff"]["only"] = ["tau"]
    check_flat(config)
    assert {s.knob for s in settings.list_settings(config)} == {settings.PRESET, "tau"}


def changed(config, path, value):
    out = deepcopy(config)
    *folders, last = path.split(".")
    at = out
    for key in folders:
        at = at[key]
    at[last] = value
    return out


@pytest.mark.parametrize(
    "path, value, said",
    [
        pytest.param("tradeoff.scene", "moon", "tradeoff: moon is no scene", id="no such scene"),
        pytest.param("tradeoff.knob", {}, "tradeoff: there is no key 'knob'; is 'knobs' meant", id="a typo"),
        pytest.param("tradeoff.base.preset", "best", "tradeoff.base: there is no preset 'best'", id="no such base"),
        pytest.param("tradeoff.base.rounds", 0, "tradeoff.base.rounds: .*greater", id="no round"),
        pytest.param("tradeoff.presets", ["best"], "tradeoff.presets: there is no preset 'best'", id="no such preset"),
        pytest.param("tradeoff.only", ["caps"], "tradeoff.only: there is no knob 'caps'", id="no such knob"),
        pytest.param("tradeoff.knobs.max_gaussians.values", [5], "draft-max_gaussians-5.*greater", id="out of range"),
        pytest.param("tradeoff.knobs.sh_degree.values", [9], "draft-sh_degree-9", id="a degree too many"),
        pytest.param("tradeoff.knobs.max_gaussians.key", "cup", "no key 'cup'", id="no such key"),
        pytest.param("tradeoff.knobs.tau.values", [1.5], "values are from 0 to 1", id="tau above 1"),
        pytest.param("tradeoff.knobs.samples.base", {}, "samples: makes no difference to the policy", id="no prior"),
        pytest.param("presets.draft-max_gaussians-70000", {}, "presets.draft-max_gaussians-70000", id="an empty entry"),
    ],
)
def test_what_makes_no_sense_is_named(config, path, value, said):
    check_flat(config)
    with pytest.raises(InputError, match=f"config: .*{said}"):
        check_flat(changed(config, path, value))


def test_an_entry_of_ones_own_must_not_have_the_name_of_a_setting(config):
    mine = config["presets"]["standard"]
    with pytest.raises(InputError, match="presets.draft-max_gaussians-70000: .* makes an entry of this name"):
        check_flat(changed(config, "presets.draft-max_gaussians-70000", mine))
