"""Rules are given the keys that they read, and no others."""

import pickle
from dataclasses import fields

import numpy as np
import pytest

from dav_gswt.capture import serial_rig
from dav_gswt.config.load import check_model
from dav_gswt.config.rule_keys import EntryKeys, select_preset_keys, select_scene_keys
from dav_gswt.config.scenes import PhotoScene, SyntheticScene
from dav_gswt.config.settings import Preset
from dav_gswt.errors import InputError
from dav_gswt.geometry.cameras import Camera
from dav_gswt.photos.synthetic import scene as synthetic
from dav_gswt.reconstruction.fitting.plan import FitSettings
from dav_gswt.views import candidates

RIG = {"port": "p", "inbox": "in", "millimetres": 250.0, "limits": dict.fromkeys(("pan", "tilt", "radius"), (0, 1000))}
SYNTHETIC = {"kind": "synthetic", "family": "desert", "seed": 0, "photos": 5, "test": 2, "size": 128}
SYNTHETIC |= {"agent": "render", "preset": "draft", "tiling": "auto", "oblique": 2, "walkers": 2, "layout": "cap"}
PHOTOS = {"kind": "photos", "folder": "x", "size": 512, "start": 8, "preset": "draft", "tiling": "auto"}


def photo_scene(agent: str) -> dict:
    given = PHOTOS | {"agent": agent} | ({"rig": RIG} if agent == "serial" else {})
    return check_model(PhotoScene, given).model_dump(mode="json", exclude_none=True)


@pytest.fixture
def synthetic_scene() -> dict:
    return check_model(SyntheticScene, SYNTHETIC).model_dump(mode="json", exclude_none=True)


def test_a_rule_has_the_keys_that_it_is_given():
    keys = EntryKeys({"a": 1, "b": 2, "rig": {"limits": 3, "port": 4}}, ("a", "missing", "rig.limits"))
    assert keys == {"a": 1, "rig": {"limits": 3}} and repr(keys) == "{'a': 1, 'rig': {'limits': 3}}"
    assert keys.get("missing", 5) == 5 and "missing" not in keys


@pytest.mark.parametrize("read", [lambda keys: keys["b"], lambda keys: keys.get("b", 0), lambda keys: "b" in keys])
def test_a_key_that_a_rule_is_not_given_has_no_default(read):
    with pytest.raises(LookupError, match="not given the key 'b'"):
        read(EntryKeys({"a": 1, "b": 2}, ["a"]))


def test_jobs_receive_keys_with_their_guard():
    sent = pickle.loads(pickle.dumps(EntryKeys({"a": 1, "rig": {"limits": 3}}, ["a", "rig.limits"])))
    assert sent == {"a": 1, "rig": {"limits": 3}}
    with pytest.raises(LookupError):
        sent["rig"].get("port")


@pytest.mark.parametrize("rule", ["fit_coarse", "update_field", "fit_chosen_photos"])
def test_a_fit_is_given_all_keys_of_its_settings(rule):
    preset = {key: 1.0 if key == "spacing" else 2 for key in Preset.model_fields}
    found = FitSettings.from_preset(select_preset_keys(rule, preset))
    assert found == FitSettings.from_preset(preset) and found.sh_degree == 2


def test_scores_are_given_all_keys_of_a_rig_s_reach():
    given = select_scene_keys("score_coarse", photo_scene("serial"))["rig"]
    assert given.allowed == {field.name for field in fields(serial_rig.RigReach)}
    assert serial_rig.filter_reachable({"rig": given}, synthetic.make_scene("desert", 0).frame, []) == []


def test_what_renders_photos_reads_only_its_keys(synthetic_scene):
    given = select_scene_keys("render_photos", synthetic_scene)
    assert synthetic.scene_from_config(given) == synthetic.scene_from_config(synthetic_scene)
    assert len(synthetic.start_views(given)) == 5 and len(synthetic.test_views(given)) == 6
    assert synthetic.test_groups(given) == synthetic.test_groups(synthetic_scene)


def test_what_lists_candidates_reads_only_its_keys(synthetic_scene):
    frame = synthetic.make_scene("desert", 0).frame
    assert len(candidates.list_rendered(select_scene_keys("select_poses", synthetic_scene), frame)) == 250
    camera = Camera(np.eye(3), np.zeros(3), 100.0, 100.0, 64.0, 64.0, 128, 128)
    given = select_scene_keys("score_round", photo_scene("plan"))
    assert given["agent"] == "plan" and len(candidates.list_poses(given, frame, camera)) == 250
    with pytest.raises(InputError, match="render_candidates serves no scene with agent replay"):
        select_scene_keys("render_candidates", {"agent": "replay"})
