"""A changed key makes again what docs/reference/reruns.md says, on finished runs of a scene of each kind."""

import json
from importlib.util import find_spec

import pytest
from fixtures.runs import TINY, USUAL

from dav_gswt.config.model import Config
from dav_gswt.config.scenes import FieldScene, PhotoScene, SyntheticScene
from dav_gswt.config.settings import Preset, TerrainPriorSettings, Tiling
from dav_gswt.study import reruns

OTHER_PRESET = {
    "size": 96,
    "spacing": 1.5,
    "max_gaussians": 20000,
    "steps": 60,
    "steps_per_photo": 10,
    "level_steps": 10,
}
OTHER_TILING = {"tile": 0.4, "strip": 0.125, "candidates": 24, "variants": 1, "energy": "semantic"}
PHOTOGRAPHED = {"candidates": 21, "min_elevation": 31, "burst": 2, "feasibility": {"max_distance": 900.0}}
PHOTOGRAPHED |= {"poses": {"kind": "orbit"}}
NAMED = {"preset": "other", "tiling": "other"}
SYNTHETIC = {"family": "grass", "seed": 101, "photos": 6, "start": 4, "test": 3, "layout": "cap", "oblique": 1}
SYNTHETIC |= {"walkers": 1, "size": 144, "materials": "auto", "agent": "replay"} | PHOTOGRAPHED | NAMED
RIG = {"port": "p", "inbox": "in", "millimetres": 250, "limits": {"pan": [0, 9], "tilt": [0, 9], "radius": [1, 9]}}
PHOTOS = {"folder": "other", "model": "other", "size": 480, "start": 7, "whole": True, "sfm": "careful"}
PHOTOS |= {"mapper": "global", "cameras": "one", "focal": 28, "masks": "other", "agent": "handheld"}
PHOTOS |= {"verdict": "warn", "materials": "one", "rig": RIG, "drone": {"speed": 4}} | PHOTOGRAPHED | NAMED
FIELD = {"field": "other/other.ply", "up": [0, 1, 1]} | NAMED
PRESET = {"size": 112, "spacing": 1.6, "max_gaussians": 21000, "steps": 61, "steps_per_photo": 11, "sh_degree": 1}
PRESET |= {"pose_rate": 0.001, "level_steps": 11, "levels": 1, "refit": "scratch", "choose_with": "other"}
TILING = {"tile": 0.45, "strip": 0.1, "candidates": 25, "variants": 2, "energy": "colour", "slope": 3, "replicate": 1}
TILING |= {"sam2": "other"}
PRIOR = {"samples": 3, "steps": 3, "staged": False, "posterior": True, "independent_noise": True, "lpips": True}
PRIOR |= {"weights": "other/other.ply"}
TOP_LEVEL = {"seeds": [1], "policy": "random", "prior": "other", "p_drop": 0.2, "lam": 0.2, "rounds": 2, "k": 3}
TOP_LEVEL |= {"stop": {"photos": 20}, "inpaint": True, "levels": 2, "tau": 0.3, "lpips": "installed"}
TOP_LEVEL |= {"segmenter": "fetch", "export": {"columns": 4}}
TOP_LEVEL |= {"heights": {"kind": "hills", "height": 2, "wavelength": 20}, "stills": {"width": 320, "height": 180}}
TOP_LEVEL |= {"classes": [{"kind": "noise", "weight": 2}]}
TOP_LEVEL |= {"flight": {"frames": 2, "length": 1, "height": 1}}


@pytest.fixture(scope="module")
def replanned(planned, tmp_path_factory):
    """The rules that a finished run plans with a changed config, as a list in their order."""
    folder = tmp_path_factory.mktemp("changes")
    other = folder / "other"
    other.mkdir()
    for name in ("other.ply", "model.safetensors", "photo.jpg", "encoder.onnx", "decoder.onnx"):
        (other / name).touch()

    def plan(made, change, configs=()):
        entries = {"presets": {"other": OTHER_PRESET}, "tilings": {"other": OTHER_TILING}}
        entries |= {"priors": {"other": {"model": "terrain", "samples": 3, "steps": 2}}}
        files = folder / "entries.json", folder / "change.json"
        for file, values in zip(files, (entries, change), strict=True):
            file.write_text(json.dumps(values).replace('"other/', f'"{other}/'))
        found = planned(made.folder, "--config", f"scene={made.scene}", configs=(USUAL, TINY, *configs, *files))
        names = {"request_views": "capture_views"}  # another agent takes the photos of a round in its place
        return [rule for rule in reruns.READERS if rule in {names.get(name, name) for name in found}]

    plan.other = str(other)
    return plan


def changed_entry(made, key, value, other):
    places = {"folder": other, "model": other, "masks": other}
    return {"scenes": {made.scene: {key: places.get(key, value)}}}


def changed_preset(values):
    """The draft with other values; what it no longer chooses photos for has another to choose."""
    others = dict.fromkeys(("standard", "reference", "auto"), {"choose_with": "other"})
    return {"presets": {"draft": values} | (others if "choose_with" in values else {})}


@pytest.mark.parametrize("key", SYNTHETIC)
def test_a_key_of_a_synthetic_scene_makes_again_what_reads_it(tiny, replanned, key):
    change = changed_entry(tiny, key, SYNTHETIC[key], replanned.other)
    assert replanned(tiny, change) == reruns.list_scene_reruns("synthetic", "render", key)


@pytest.mark.parametrize("key", FIELD)
def test_a_key_of_a_finished_field_makes_again_what_reads_it(finished, replanned, key):
    change = changed_entry(finished, key, FIELD[key], replanned.other)
    assert replanned(finished, change) == reruns.list_scene_reruns("field", "", key)


@pytest.mark.parametrize("key", PHOTOS)
def test_a_key_of_a_photo_scene_makes_again_what_reads_it(beach, replanned, key):
    change = changed_entry(beach, key, PHOTOS[key], replanned.other)
    configs = [beach.folder / "beach.yaml"]
    assert replanned(beach, change, configs) == reruns.list_scene_reruns("photos", "replay", key)


@pytest.mark.parametrize("key", PRESET)
def test_a_key_of_a_preset_makes_again_what_reads_it(tiny, replanned, key):
    assert replanned(tiny, changed_preset({key: PRESET[key]})) == reruns.list_preset_reruns("synthetic", key)


def test_a_key_of_a_preset_reaches_a_finished_field_where_it_is_read(finished, replanned):
    few = {key: PRESET[key] for key in PRESET if not reruns.list_preset_reruns("field", key)}
    assert {"size", "spacing", "steps", "refit", "choose_with"} <= set(few)
    for either in ("refit", "choose_with"):  # not both
        values = {key: value for key, value in few.items() if key != either}
        assert not replanned(finished, changed_preset(values))
    for key in set(PRESET) - set(few):
        found = replanned(finished, {"presets": {"draft": {key: PRESET[key]}}})
        assert found == reruns.list_preset_reruns("field", key), key


@pytest.mark.parametrize("key", TILING)
def test_a_key_of_a_tiling_makes_again_what_reads_it(tiny, replanned, key):
    change = {"tilings": {"semantic": {key: replanned.other if key == "sam2" else TILING[key]}}}
    assert replanned(tiny, change) == reruns.list_tiling_reruns("synthetic", key)


@pytest.mark.parametrize("key", TOP_LEVEL)
def test_a_key_of_the_top_level_makes_again_what_reads_it(tiny, replanned, key):
    assert replanned(tiny, {key: TOP_LEVEL[key]}) == reruns.list_top_level_reruns("synthetic", key)


@pytest.mark.skipif(not find_spec("onnxruntime"), reason="needs the extra `mobilesam`")
def test_a_segmenter_makes_again_what_follows_from_materials(beach, replanned):
    change = {"segmenter": replanned.other}
    assert replanned(beach, change, [beach.folder / "beach.yaml"]) == reruns.list_top_level_reruns(
        "photos", "segmenter"
    )


def test_a_prior_that_no_policy_reads_makes_nothing_again(tiny, replanned):
    assert not replanned(tiny, {"priors": {"terrain": PRIOR}})


def test_other_scenes_and_what_the_study_compares_make_nothing_again(tiny, replanned):
    assert not replanned(tiny, {"scenes": {"planet": {"seed": 7}}, "study": {"lod": {"seeds": [3]}}})


def test_every_key_is_changed():
    tables = {"scene", "scenes", "priors", "presets", "tilings", "study"}
    pairs = [(SYNTHETIC, SyntheticScene, {"kind"}), (PHOTOS, PhotoScene, {"kind"}), (FIELD, FieldScene, {"kind"})]
    pairs += [(PRESET, Preset, set()), (TILING, Tiling, set()), (PRIOR, TerrainPriorSettings, {"model"})]
    for changes, model, fixed in [*pairs, (TOP_LEVEL, Config, tables)]:
        assert set(changes) | fixed == set(model.model_fields), model.__name__
