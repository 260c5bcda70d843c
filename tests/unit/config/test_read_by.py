"""Rules are given the keys that they read, and no others."""

import pickle

import pytest

from dav_gswt.capture import serial_rig
from dav_gswt.config.base import EntryKeys, select_keys
from dav_gswt.config.load import check_model
from dav_gswt.config.scenes import PhotoScene
from dav_gswt.config.settings import Preset
from dav_gswt.photos.synthetic import scene as synthetic
from dav_gswt.reconstruction.fitting.plan import FitSettings

RIG = {"port": "p", "inbox": "in", "millimetres": 250.0, "limits": dict.fromkeys(("pan", "tilt", "radius"), (0, 1000))}
SYNTHETIC = {"kind": "synthetic", "family": "desert", "seed": 0, "photo_count": 5, "test": 2, "size": 128}
SYNTHETIC |= {"agent": "render", "preset": "draft", "tiling": "auto"}
PHOTOS = {"kind": "photos", "folder": "x", "size": 512, "start": 8, "preset": "draft", "tiling": "auto"}


def photo_scene(agent: str) -> dict:
    given = PHOTOS | {"agent": agent} | ({"rig": RIG} if agent == "serial" else {})
    return check_model(PhotoScene, given).model_dump(mode="json", exclude_none=True)


@pytest.mark.parametrize("read", [lambda keys: keys["b"], lambda keys: keys.get("b", 0), lambda keys: "b" in keys])
def test_a_key_that_a_rule_is_not_given_has_no_default(read):
    keys = EntryKeys({"a": 1}, ["b"])
    for each in (keys, pickle.loads(pickle.dumps(keys))):  # as a job receives it
        assert each == {"a": 1} and each.get("missing", 5) == 5 and "missing" not in each
        with pytest.raises(LookupError, match="not given the key 'b'"):
            read(each)


def test_keys_follow_from_the_rule_and_the_agent():
    read = {agent: set(select_keys(PhotoScene, "score_coarse", photo_scene(agent))) for agent in ("replay", "plan")}
    assert read == {"replay": {"agent"}, "plan": {"agent", "candidates", "poses", "drone"}}
    assert select_keys(PhotoScene, "score_coarse", photo_scene("plan"))["drone"] == {"min_altitude": 2.0}
    assert "clearance" in select_keys(PhotoScene, "request_views", photo_scene("plan"))["drone"]
    assert set(select_keys(PhotoScene, "register_photos", photo_scene("replay"))) == {"folder", "size"}


@pytest.mark.parametrize("rule", ["fit_coarse", "update_field", "fit_chosen_photos"])
def test_a_fit_is_given_all_keys_of_its_settings(rule):
    preset = {key: 1.0 if key == "spacing" else 2 for key in Preset.model_fields}
    found = FitSettings.from_preset(select_keys(Preset, rule, preset))
    assert found == FitSettings.from_preset(preset) and found.sh_degree == 2


def test_scores_are_given_all_keys_of_a_rig_s_reach():
    given = select_keys(PhotoScene, "score_coarse", photo_scene("serial"))["rig"]
    assert not {"millimetres", "limits"} & given.withheld and "port" in given.withheld
    assert serial_rig.filter_reachable({"rig": given}, synthetic.Scene("desert", 0).frame, []) == []
