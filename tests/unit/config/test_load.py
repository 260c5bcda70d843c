"""The config is closed: what is wrong is named before the first job; rules are given the keys that they read."""

import pickle
import re
import runpy
import shutil
from copy import deepcopy
from pathlib import Path

import pytest

from dav_gswt.capture import serial_rig
from dav_gswt.config.base import EntryKeys, select_keys
from dav_gswt.config.load import add_scene_files, check_config, check_model, parse_command_line, read_config
from dav_gswt.config.scenes import PhotoScene
from dav_gswt.config.settings import Preset
from dav_gswt.errors import InputError
from dav_gswt.photos.synthetic import scene as synthetic
from dav_gswt.reconstruction.fitting.plan import FitSettings

FILES = {
    "usual": [],
    "smallest": ["config/test/config.yaml"],
    "without a compiler": ["config/without_compiler.yaml"],
}


def read(root: Path, *more: str) -> dict:
    files = [root / "config/config.yaml", *(root / file for file in more)]
    return add_scene_files(read_config(files), root / "config/scenes")


@pytest.fixture
def config(root):
    return read(root)


def changed(config: dict, keys: list[str], value) -> dict:
    config = deepcopy(config)
    table = config
    for key in keys[:-1]:
        table = table.setdefault(key, {})
    table[keys[-1]] = value
    return config


@pytest.mark.parametrize("name", FILES)
def test_the_configs_that_come_with_the_project_are_valid(root, name):
    checked = check_config(read(root, *FILES[name]))
    assert checked["scene"] in checked["scenes"]
    assert check_config(checked) == checked


def test_a_folder_alone_is_a_scene(config):
    checked = check_config(changed(config, ["scenes", "My_Sand"], {"kind": "photos", "folder": ["a", "b"]}))
    scene = checked["scenes"]["My_Sand"]
    assert "start" not in scene and "test" not in scene
    assert {key: scene[key] for key in ("size", "agent", "preset", "tiling", "materials")} == {
        **{"size": 1024, "agent": "replay", "preset": "standard", "tiling": "auto", "materials": "auto"}
    }


RIG = {"port": "p", "inbox": "in", "millimetres": 250, "limits": {"pan": [0, 1], "tilt": [0, 1], "radius": [0, 1]}}


@pytest.mark.parametrize(
    "keys, value, message",
    [
        pytest.param(["polcy"], "farthest", "config: there is no key 'polcy'; is 'policy' meant?", id="a typo"),
        pytest.param(
            ["scenes", "desert", "prset"], "x", "desert: there is no key 'prset'; is 'preset'", id="in a table"
        ),
        pytest.param(["tau"], 1.5, "config: tau: .*less than or equal to 1", id="tau above 1"),
        pytest.param(["scene"], "moon", "scene: there is no 'moon'; scenes has", id="an unknown scene"),
        pytest.param(["scenes", "desert", "preset"], "best", "preset: there is no 'best'", id="an unknown preset"),
        pytest.param(["scenes", "logs"], {}, "scenes.logs: 'logs' is no name", id="a scene with a reserved name"),
        pytest.param(["presets", "draft", "choose_with"], "best", "there is no 'best'", id="an unknown chooser"),
        pytest.param(["presets", "draft", "choose_with"], "draft", "chooses no photos itself", id="its own chooser"),
        pytest.param(["presets", "reference", "choose_with"], "standard", "one that does .draft", id="no chooser"),
        pytest.param(["stills"], {"width": 8}, "config: stills: there is no key 'width'; .*valid list", id="a table"),
        pytest.param(["priors", "z"], {"model": "zero123", "samples": 2, "steps": 2}, "z: .* needs `weights`", id="z"),
        pytest.param(["sweeps", "tau"], [0.3, 2], "sweeps.tau: input should be less than or equal to 1", id="swept"),
        pytest.param(["scenes", "copr_dunes", "agent"], "serial", "copr_dunes: agent serial needs `rig`", id="no rig"),
        pytest.param(["scenes", "copr_dunes", "rig"], RIG | {"limits": {}}, "limits.pan: is missing", id="no limits"),
        pytest.param(["priors", "none"], {"model": "terrain", "samples": 2, "steps": 2}, "priors.none", id="name none"),
    ],
)
def test_what_is_wrong_is_named(config, keys, value, message):
    with pytest.raises(InputError, match=message):
        check_config(changed(config, keys, value))


@pytest.mark.parametrize(
    "change, message",
    [
        pytest.param({"scene": "finished"}, "finished is a finished field.*inpaint: false", id="no photos"),
        pytest.param({"prior": "other"}, r"other knows no depth.*\(terrain.* in priors\)", id="no depth"),
    ],
)
def test_what_cannot_be_inpainted_is_refused_and_why(root, change, message):
    config = read(root)
    config["scenes"]["finished"] = {"kind": "field", "field": "a.ply", "preset": "draft", "tiling": "auto"}
    config["priors"]["other"] = {"model": "zero123", "weights": "a", "samples": 2, "steps": 2}
    with pytest.raises(InputError, match=message):
        check_config(config | {"inpaint": True} | change)


@pytest.mark.parametrize(
    "change, message",
    [
        ({"field": "a b.ksplat"}, "finished.*a .ksplat .*npx @playcanvas/splat-transform 'a b.ksplat' 'a b.ply'"),
        ({"field": "a.sog"}, "finished.*a SOG .*npx @playcanvas/splat-transform a.sog a.ply"),
        ({"field": "a.obj"}, "finished.*ends in .ply or .spz"),
        ({"crop": [[0, 0, 0], [1, 0, 1]]}, "finished.*crop: its first corner must be the lower one"),
        ({"up": [0, float("inf"), 0]}, r"scenes.finished.up.1: .*finite"),
    ],
)
def test_a_finished_field_that_cannot_be_meant_is_refused(root, change, message):
    config = read(root)
    entry = {"kind": "field", "field": "a.SPZ", "preset": "draft", "tiling": "auto", "crop": [[0, 0, 0], [1, 1, 1]]}
    config["scenes"]["finished"] = entry
    assert check_config(config)["scenes"]["finished"]["field"] == "a.SPZ"
    config["scenes"]["finished"] = entry | change
    with pytest.raises(InputError, match=message):
        check_config(config)


def test_a_config_replaces_another_key_by_key(tmp_path):
    (tmp_path / "below.yaml").write_text("{k: 4, export: {rows: 2, columns: 1}, seeds: [0, 1]}")
    (tmp_path / "above.yaml").write_text("{export: {rows: 8}, seeds: [5]}")
    files = [tmp_path / "below.yaml", tmp_path / "above.yaml"]
    assert read_config(files, {"k": 2}) == {"k": 2, "export": {"rows": 8, "columns": 1}, "seeds": [5]}


FIELD = {"kind": "field", "field": "a.ply", "preset": "draft", "tiling": "auto"}


def test_a_scene_of_the_config_replaces_keys_of_its_file(tmp_path):
    (tmp_path / "sand.yaml").write_text(str(FIELD))
    assert add_scene_files({"scenes": None}, tmp_path)["scenes"] == {"sand": FIELD}
    scenes = add_scene_files({"scenes": {"sand": {"field": "b.ply"}, "other": {"kind": "field"}}}, tmp_path)["scenes"]
    assert scenes == {"sand": FIELD | {"field": "b.ply"}, "other": {"kind": "field"}}


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("kind: field\npreset: draft\ntiling: auto\n", "scenes.halfdone.*is missing"),
        ("kind: photos\nfolder: x\nprset: draft\n", "there is no key 'prset'"),
        ("kind: field\nfield: x.ply\npreset: best\ntiling: auto\n", "preset: there is no 'best'"),
        ("kind: [", "not YAML"),
        ("{}", "scenes.halfdone"),
    ],
)
def test_a_bad_file_stops_its_own_scene_only(root, tmp_path, text, reason, caplog):
    (tmp_path / "halfdone.yaml").write_text(text)
    shutil.copy(root / "config/scenes/desert.yaml", tmp_path)
    usual = read_config([root / "config/config.yaml"])
    assert "halfdone" not in check_config(add_scene_files(usual, tmp_path))["scenes"]
    assert re.search(rf"halfdone.yaml: the scene is left out: .*{reason}", caplog.text)
    caplog.clear()
    assert list(add_scene_files(usual, tmp_path, quietly=True)["scenes"]) == ["desert"] and not caplog.text
    with pytest.raises(InputError, match=reason):
        check_config(add_scene_files(usual | {"scene": "halfdone"}, tmp_path))
    with pytest.raises(InputError, match="config: k: "):  # which no scene can mend
        check_config(add_scene_files(usual | {"k": 0}, tmp_path))


def test_two_scenes_of_one_name_are_named(tmp_path):
    (tmp_path / "sand.yaml").write_text(str(FIELD))
    with pytest.raises(InputError, match=r"sand\.yaml: the config has a scene sand of kind synthetic, too"):
        add_scene_files({"scenes": {"sand": {"kind": "synthetic"}}}, tmp_path)
    (tmp_path / "sand.yml").write_text(str(FIELD))
    with pytest.raises(InputError, match=r"sand\.yml: there is a scene of this name in sand\.yaml"):
        add_scene_files({}, tmp_path)


@pytest.mark.parametrize(
    "text, message",
    [("a: [1", "not YAML .*line"), ("- a", "holds no keys"), (None, "not readable")],
)
def test_a_config_file_that_cannot_be_read_is_named(tmp_path, text, message):
    if text is not None:
        (tmp_path / "a.yaml").write_text(text)
    with pytest.raises(InputError, match=f"a.yaml: {message}"):
        read_config([tmp_path / "a.yaml"])


def test_numbers_in_lists_and_tables_of_the_command_line_are_numbers():
    """As Snakemake reads `--config`: scalars are parsed, what is in lists and tables is text."""
    given = {"seeds": ["1", "2"], "export": {"rows": "8"}, "scene": "desert", "tau": 0.3, "inpaint": True}
    parsed = {"seeds": [1, 2], "export": {"rows": 8}, "scene": "desert", "tau": 0.3, "inpaint": True}
    assert parse_command_line(given) == parsed


@pytest.mark.parametrize("order", [("k", "views_per_round"), ("views_per_round", "k")])
def test_views_per_round_is_k_and_counts_before_it(root, order):
    values = {"k": 4, "views_per_round": 3}
    checked = check_config(read(root) | {name: values[name] for name in order})
    assert checked["k"] == 3 and "views_per_round" not in checked


def test_the_reference_and_the_schema_are_those_of_the_models(root):
    make_reference = runpy.run_path(str(root / "workflow/reference.py"))["make_reference"]
    stale = [name for name, text in make_reference().items() if (root / name).read_text() != text]
    assert not stale, "run `make reference`"


SERIAL = {
    "port": "p",
    "inbox": "in",
    "millimetres": 250.0,
    "limits": dict.fromkeys(("pan", "tilt", "radius"), (0, 1000)),
}
SYNTHETIC = {"kind": "synthetic", "family": "desert", "seed": 0, "photo_count": 5, "test": 2, "size": 128}
SYNTHETIC |= {"agent": "render", "preset": "draft", "tiling": "auto"}
PHOTOS = {"kind": "photos", "folder": "x", "size": 512, "start": 8, "preset": "draft", "tiling": "auto"}


def photo_scene(agent: str) -> dict:
    given = PHOTOS | {"agent": agent} | ({"rig": SERIAL} if agent == "serial" else {})
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
