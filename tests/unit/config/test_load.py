"""The config is closed: what is misspelt, renamed or out of range is named before the first job."""

import re
from copy import deepcopy
from pathlib import Path

import pytest

from dav_gswt.config.base import LARGEST_SIDE
from dav_gswt.config.load import add_scene_files, check_config, parse_command_line, read_config
from dav_gswt.errors import InputError

FILES = {"usual": [], "smallest": ["config/test/config.yaml"], "paper": ["config/paper.yaml"]}
FILES |= {
    "hundred views": ["config/hundred_views.yaml"],
    "development": ["config/development.yaml"],
    "without a compiler": ["config/without_compiler.yaml"],
}


def read(root: Path, *more: str) -> dict:
    files = [root / "config/config.yaml", root / "config/study.yaml", *(root / file for file in more)]
    return add_scene_files(read_config(files), root / "config/scenes")


@pytest.fixture(params=["usual", "smallest"])
def config(request, root):
    return read(root, *FILES[request.param])


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


def test_defaults_are_filled_in(root):
    assert check_config(read(root))["scenes"]["copr_dunes"]["sfm"] == "quick"


def test_a_checked_config_stays_the_same_when_it_is_checked_again(config):
    checked = check_config(config)
    assert check_config(checked) == checked


def test_native_photos_are_those_of_any_size(config):
    native = changed(
        changed(config, ["scenes", "copr_dunes", "size"], "native"), ["presets", "draft", "size"], "native"
    )
    checked = check_config(native)
    assert checked["scenes"]["copr_dunes"]["size"] == checked["presets"]["draft"]["size"] == LARGEST_SIDE


@pytest.mark.parametrize(
    "keys, value, message",
    [
        pytest.param(["polcy"], "farthest", "config: there is no key 'polcy'; is 'policy' meant?", id="a typo"),
        pytest.param(["tau"], 1.5, "config: tau: .*less than or equal to 1", id="tau above 1"),
        pytest.param(["levels"], 0, "levels", id="no level"),
        pytest.param(["policy"], "nearest", "config: policy: ", id="an unknown policy"),
        pytest.param(["scene"], "moon", "scene: there is no 'moon'; scenes has", id="an unknown scene"),
        pytest.param(["scenes", "desert", "tiling"], "glue", "tiling: there is no 'glue'", id="an unknown tiling"),
        pytest.param(["scenes", "desert", "preset"], "best", "preset: there is no 'best'", id="an unknown preset"),
        pytest.param(["scenes", "desert", "famly"], "x", "scenes.desert: .*'famly'; is 'family'", id="typo in a scene"),
        pytest.param(["scenes", "desert", "kind"], "video", "scenes.desert", id="an unknown kind"),
        pytest.param(["scenes", "Desert"], {}, "scenes.Desert: 'Desert' is no name", id="a scene in capitals"),
        pytest.param(["scenes", "logs"], {}, "scenes.logs: 'logs' is no name", id="a scene with a reserved name"),
        pytest.param(
            ["export"], {"axes": "y-down", "formats": ["usd"]}, "export: .*a USD stage has y or z up", id="down"
        ),
        pytest.param(["presets", "draft", "spacing"], 0, "presets.draft.spacing", id="discs without a distance"),
        pytest.param(["presets", "draft", "choose_with"], "best", "there is no 'best'", id="an unknown chooser"),
        pytest.param(
            ["presets", "draft", "choose_with"], "draft", "draft chooses no photos itself", id="its own chooser"
        ),
        pytest.param(
            ["presets", "reference", "choose_with"],
            "standard",
            "name one that does .draft",
            id="a chooser that chooses nothing",
        ),
        pytest.param(
            ["presets", "draft", "size"], "own", "presets.draft.size: .*or input should be 'native'", id="a word"
        ),
        pytest.param(["scenes", "copr_dunes", "size"], 20_000, "less than or equal to 16384", id="too large a photo"),
        pytest.param(["stop", "photo"], 20, "stop: there is no key 'photo'; is 'photos' meant", id="a typo in a stop"),
        pytest.param(["stop", "photos"], 2, "stop.photos", id="fewer photos than any start"),
        pytest.param(["stop", "photos"], 20.5, "stop.photos", id="half a photo"),
        pytest.param(["stop", "marginal_gain"], 0, "stop.marginal_gain", id="no price"),
        pytest.param(["stop", "marginal_gain"], "auto", "stop.marginal_gain", id="a price that is no number"),
        pytest.param(["stop"], 20, "config: stop: ", id="a stop without its key"),
        pytest.param(["heights", "kind"], "fractal", "heights", id="an unknown surface"),
        pytest.param(["heights", "height"], 2, "heights: there is no key 'height'", id="a plain with a height"),
        pytest.param(["heights"], {"kind": "hills", "height": 1}, "heights.wavelength: is missing", id="no width"),
        pytest.param(["heights"], {"kind": "hills", "height": 1, "wavelength": 0.5}, "wavelength", id="spikes"),
        pytest.param(["heights"], {"kind": "sphere", "radius": 3.9}, "heights.radius", id="a pebble"),
        pytest.param(["heights"], {"kind": "sphere", "radius": 2e7}, "heights.radius", id="a sun"),
        pytest.param(["heights"], {"kind": "image", "file": "a.exr", "width": 0, "height": 1}, "width", id="a point"),
        pytest.param(["flight"], {"frames": 1, "length": 1, "height": 1}, "flight.frames", id="one frame"),
        pytest.param(["flight"], {"frames": 8, "length": 1}, "flight: height is missing", id="no height"),
        pytest.param(["tilings", "auto", "tile"], 1.2, "tilings.auto.tile", id="a tile larger than its exemplar"),
        pytest.param(["tilings", "auto", "strip"], "texture", "tilings.auto.strip", id="no size of a strip"),
        pytest.param(["tilings", "auto", "energy"], "semantics", "tilings.auto.energy", id="an unknown energy"),
        pytest.param(["tilings", "auto", "slope"], 0, "tilings.auto.slope", id="a gamma that never falls"),
        pytest.param(["tilings", "auto", "sam"], "folder", "is 'sam2' meant", id="a typo in a tiling"),
        pytest.param(["inpaint"], "yes", "inpaint: .*boolean", id="no boolean"),
        pytest.param(["prior"], "none", "prior: there is no 'none'", id="no prior"),
        pytest.param(["priors", "none"], {"model": "terrain", "samples": 2, "steps": 2}, "priors.none", id="name none"),
        pytest.param(["lpips"], "", "lpips", id="an empty path"),
    ],
)
def test_what_is_wrong_is_named(config, keys, value, message):
    with pytest.raises(InputError, match=message):
        check_config(changed(config, keys, value))


@pytest.mark.parametrize(
    "keys, value, message",
    [
        pytest.param(["qualities"], {}, "'qualities' is called 'presets' now", id="a table"),
        pytest.param(["presets", "draft", "cap"], 1000, "'cap' is called 'max_gaussians' now", id="a preset's key"),
        pytest.param(["scenes", "desert", "quality"], "draft", "'quality' is called 'preset' now", id="a scene's key"),
        pytest.param(["scenes", "desert", "rig"], "cap", "'rig' is called 'layout' now", id="a synthetic scene's key"),
        pytest.param(["scenes", "copr_dunes", "flight"], {}, "'flight' is called 'drone' now", id="a photo's key"),
        pytest.param(["stop", "worth"], 0.05, "'worth' is called 'marginal_gain' now", id="a key of stop"),
        pytest.param(["complete"], True, "'complete' is called 'inpaint' now", id="a key of its own"),
        pytest.param(["sweeps"], {}, "sweeps: is called `study.sweeps` now", id="a table of the study"),
        pytest.param(
            ["benchmark"], {}, "benchmark: is called `study.view_benchmark` now", id="a renamed table of the study"
        ),
    ],
)
def test_a_renamed_key_comes_with_its_new_name(root, keys, value, message):
    with pytest.raises(InputError, match=message):
        check_config(changed(read(root), keys, value))


def test_a_missing_key_is_named(config):
    del config["presets"]["draft"]["max_gaussians"]
    with pytest.raises(InputError, match="config: presets.draft.max_gaussians: is missing"):
        check_config(config)


def test_a_rig_is_needed_by_the_agent_that_drives_one(root):
    config = changed(read(root), ["scenes", "copr_dunes", "agent"], "serial")
    with pytest.raises(InputError, match="scenes.copr_dunes: agent serial needs `rig`"):
        check_config(config)


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
    config["priors"]["other"] = {"model": "zero123", "folder": "a", "samples": 2, "steps": 2}
    with pytest.raises(InputError, match=message):
        check_config(config | {"inpaint": True} | change)


def test_a_config_replaces_another_key_by_key(tmp_path):
    (tmp_path / "below.yaml").write_text("{k: 4, stills: {width: 2, height: 1}, seeds: [0, 1]}")
    (tmp_path / "above.yaml").write_text("{stills: {width: 8}, seeds: [5]}")
    files = [tmp_path / "below.yaml", tmp_path / "above.yaml"]
    assert read_config(files, {"k": 2}) == {"k": 2, "stills": {"width": 8, "height": 1}, "seeds": [5]}


def test_a_scene_of_the_config_replaces_keys_of_its_file(tmp_path):
    (tmp_path / "sand.yaml").write_text("{kind: synthetic, size: 128}")
    scenes = add_scene_files({"scenes": {"sand": {"size": 64}, "other": {"kind": "field"}}}, tmp_path)["scenes"]
    assert scenes == {"sand": {"kind": "synthetic", "size": 64}, "other": {"kind": "field"}}


def test_files_of_editors_and_file_systems_are_no_scenes(tmp_path):
    (tmp_path / "sand.yml").write_text("{kind: synthetic}")
    (tmp_path / "._sand.yaml").write_bytes(b"\0\5\x16\7")
    (tmp_path / ".#sand.yaml").symlink_to(tmp_path / "gone")
    assert add_scene_files({}, tmp_path)["scenes"] == {"sand": {"kind": "synthetic"}}


def test_two_scenes_of_one_name_are_named(tmp_path):
    (tmp_path / "sand.yaml").write_text("{kind: photos}")
    with pytest.raises(InputError, match=r"sand\.yaml: the config has a scene sand of kind synthetic, too"):
        add_scene_files({"scenes": {"sand": {"kind": "synthetic"}}}, tmp_path)
    (tmp_path / "sand.yml").write_text("{kind: photos}")
    with pytest.raises(InputError, match=r"sand\.yml: there is a scene of this name in sand\.yaml"):
        add_scene_files({}, tmp_path)


def test_the_commented_scenes_of_the_config_can_be_uncommented(root, tmp_path):
    text = (root / "config/config.yaml").read_text()
    (tmp_path / "config.yaml").write_text(re.sub(r"^# (?=scenes:|  my_)", "", text, flags=re.M))
    config = check_config(add_scene_files(read_config([tmp_path / "config.yaml"]), root / "config/scenes"))
    assert {"my_meadow", "my_splat", "desert"} <= set(config["scenes"])


def test_a_table_of_scenes_may_be_empty(tmp_path):
    (tmp_path / "config.yaml").write_text("scene: sand\nscenes:\n")
    (tmp_path / "scenes").mkdir()
    (tmp_path / "scenes/sand.yaml").write_text("{kind: synthetic}")
    config = add_scene_files(read_config([tmp_path / "config.yaml"]), tmp_path / "scenes")
    assert config["scenes"] == {"sand": {"kind": "synthetic"}}


@pytest.mark.parametrize(
    "text, message",
    [("a: [1", "not YAML .*line"), ("", "holds no keys"), ("- a", "holds no keys"), (None, "not readable")],
)
def test_a_config_file_that_cannot_be_read_is_named(tmp_path, text, message):
    if text is not None:
        (tmp_path / "a.yaml").write_text(text)
    with pytest.raises(InputError, match=f"a.yaml: {message}"):
        read_config([tmp_path / "a.yaml"])


def test_numbers_in_lists_and_tables_of_the_command_line_are_numbers():
    """As Snakemake reads `--config`: scalars are parsed, what is in lists and tables is text."""
    given = {"seeds": ["1", "2"], "stills": {"width": "320"}, "scene": "desert", "tau": 0.3, "inpaint": True}
    parsed = {"seeds": [1, 2], "stills": {"width": 320}, "scene": "desert", "tau": 0.3, "inpaint": True}
    assert parse_command_line(given) == parsed


@pytest.mark.parametrize("order", [("k", "views_per_round"), ("views_per_round", "k")])
def test_views_per_round_is_k_and_counts_before_it(root, order):
    values = {"k": 4, "views_per_round": 3}
    checked = check_config(read(root) | {name: values[name] for name in order})
    assert checked["k"] == 3 and "views_per_round" not in checked


def test_k_that_is_out_of_range_is_named_by_either_name(root):
    with pytest.raises(InputError, match="config: k: input should be greater"):
        check_config(read(root) | {"views_per_round": 0})
