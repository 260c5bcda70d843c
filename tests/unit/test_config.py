from copy import deepcopy
from pathlib import Path

import pytest
import yaml

from dav_gswt.config import check, read
from dav_gswt.errors import InputError

ROOT = Path(__file__).parents[2]
SCHEMA = ROOT / "workflow/schemas/config.schema.yaml"


@pytest.fixture(params=["config/config.yaml", "config/test/config.yaml"])
def config(request):
    return yaml.safe_load((ROOT / request.param).read_text())


def test_the_configs_that_come_with_the_project_are_valid(config):
    check(config, SCHEMA)


@pytest.mark.parametrize(
    "keys, value, named",
    [
        pytest.param(["polcy"], "farthest", "polcy", id="a typo"),
        pytest.param(["tau"], 1.5, "tau", id="tau above 1"),
        pytest.param(["levels"], 0, "levels", id="no level"),
        pytest.param(["policy"], "nearest", "policy", id="an unknown policy"),
        pytest.param(["scene"], "moon", "moon", id="a scene that is not there"),
        pytest.param(["scenes", "desert", "seam"], "glue", "glue", id="a seam that is not there"),
        pytest.param(["scenes", "desert", "quality"], "best", "best", id="a quality that is not there"),
        pytest.param(["scenes", "desert", "famly"], "desert", "famly", id="a typo in a scene"),
        pytest.param(["scenes", "desert", "kind"], "video", "kind", id="a kind that is not there"),
        pytest.param(["qualities", "draft", "spacing"], 0, "spacing", id="discs without a distance"),
        pytest.param(["stop", "photo"], 20, "photo", id="a typo in a stop"),
        pytest.param(["stop", "photos"], 2, "stop.photos", id="fewer photos than any start"),
        pytest.param(["stop", "photos"], 20.5, "stop.photos", id="half a photo"),
        pytest.param(["stop", "worth"], 0, "stop.worth", id="a price of nothing"),
        pytest.param(["stop", "worth"], "auto", "stop.worth", id="a price that is no number"),
        pytest.param(["stop"], 20, "stop: 20", id="a stop without its key"),
        pytest.param(["heights", "kind"], "fractal", "heights.kind", id="a surface that is not there"),
        pytest.param(["heights", "height"], 2, "height", id="a plain that is high"),
        pytest.param(["heights"], {"kind": "hills", "height": 1}, "wavelength", id="hills without width"),
        pytest.param(["heights"], {"kind": "hills", "height": 1, "wavelength": 0.5}, "wavelength", id="spikes"),
        pytest.param(["heights"], {"kind": "image", "file": "a.exr", "width": 0, "height": 1}, "width", id="a point"),
        pytest.param(["flight"], {"frames": 1, "length": 1, "height": 1}, "flight.frames", id="a flight of one frame"),
        pytest.param(["flight"], {"frames": 8, "length": 1}, "'height'", id="a flight at no height"),
        pytest.param(["seams", "semantic", "tile"], 1.2, "tile", id="a tile larger than its exemplar"),
        pytest.param(["seams", "semantic", "strip"], "texture", "strip", id="no size of a strip"),
        pytest.param(["seams", "semantic", "energy"], "semantics", "energy", id="a way to cut that is not there"),
        pytest.param(["seams", "semantic", "slope"], 0, "slope", id="a gamma that never falls"),
        pytest.param(["seams", "semantic", "sam"], "folder", "is .sam2. meant", id="a typo in a seam"),
        pytest.param(["scenes", "desert", "seam"], "glue-refined", "glue-refined", id="refined, but not cut"),
        pytest.param(["seams", "semantic", "refine"], {"prior": "terrain"}, "strength", id="a repair without strength"),
        pytest.param(
            ["seams", "semantic", "refine"], {"prior": "terrain", "strength": 2}, "strength", id="more than noise"
        ),
        pytest.param(
            ["seams", "semantic", "refine"],
            {"prior": "moon", "strength": 0.2},
            "refine.prior: moon",
            id="no such prior",
        ),
    ],
)
def test_what_is_wrong_is_named(config, keys, value, named):
    broken = deepcopy(config)
    place = broken
    for key in keys[:-1]:
        place = place[key]
    place[keys[-1]] = value
    with pytest.raises(InputError, match=named):
        check(broken, SCHEMA)


@pytest.mark.parametrize(
    "change, said",
    [
        pytest.param({"baseline": "w2"}, "baseline: w2 is not among", id="a baseline that is not run"),
        pytest.param(
            {"sets": [{"scenes": ["desert"], "k": [4], "photos": 20}]}, "desert is no scene with", id="no pool"
        ),
        pytest.param({"policies": ["farthest", {"policy": "w2", "prior": "x"}]}, "no prior 'x'", id="no such prior"),
        pytest.param({"sets": [{"scenes": ["moon"], "k": [4], "photos": 20}]}, "moon is no scene", id="no scene"),
        pytest.param(
            {"sets": [{"scenes": ["desert_pool"], "k": [4], "photos": 11}]}, "leave no round of 4", id="no room"
        ),
    ],
)
def test_a_comparison_that_cannot_be_made_is_refused(change, said):
    config = yaml.safe_load((ROOT / "config/config.yaml").read_text())
    check(config, SCHEMA)
    with pytest.raises(InputError, match=said):
        check(config | {"benchmark": config["benchmark"] | change}, SCHEMA)


@pytest.mark.parametrize(
    "change, said",
    [
        pytest.param({"scenes": ["moon"]}, "seam_study.scenes: there is no 'moon'", id="no such scene"),
        pytest.param({"seams": ["glue", "colour"]}, "seam_study.seams: there is no 'glue'", id="no such seam"),
        pytest.param({"baseline": "none", "seams": ["colour"]}, "none is not among", id="a baseline that is not cut"),
        pytest.param({"seams": []}, "seam_study.seams", id="nothing to compare"),
        pytest.param({"draws": 0}, "seam_study.draws", id="no tiles"),
        pytest.param({"scenes": "desert"}, "seam_study.scenes", id="a name where a list belongs"),
    ],
)
def test_seams_that_cannot_be_compared_are_refused(change, said):
    config = yaml.safe_load((ROOT / "config/config.yaml").read_text())
    with pytest.raises(InputError, match=said):
        check(config | {"seam_study": config["seam_study"] | change}, SCHEMA)


def test_a_missing_key_is_named(config):
    del config["qualities"]["draft"]["cap"]
    with pytest.raises(InputError, match="cap"):
        check(config, SCHEMA)


def test_every_key_of_the_schema_is_explained():
    text = (ROOT / "config/README.md").read_text()
    schema = yaml.safe_load(SCHEMA.read_text())
    keys = set(schema["properties"]) - {"stills"}
    for table in ("stop", "flight"):
        keys |= set(schema["properties"][table]["properties"])
    for kind in schema["properties"]["heights"]["allOf"]:
        keys |= set(kind["then"]["properties"])
    for kind in schema["properties"]["scenes"]["additionalProperties"]["allOf"]:
        keys |= set(kind["then"]["properties"])
    for table in ("qualities", "seams"):
        keys |= set(schema["properties"][table]["additionalProperties"]["properties"])
    assert not [key for key in keys if f"`{key}`" not in text]


def test_a_config_is_laid_over_another_key_by_key(tmp_path):
    (tmp_path / "below.yaml").write_text("{k: 4, stills: {width: 2, height: 1}, seeds: [0, 1]}")
    (tmp_path / "above.yaml").write_text("{stills: {width: 8}, seeds: [5]}")
    files = [tmp_path / "below.yaml", tmp_path / "above.yaml"]
    assert read(files, {"k": 2}) == {"k": 2, "stills": {"width": 8, "height": 1}, "seeds": [5]}


def test_a_key_that_is_misspelt_comes_with_the_one_that_is_meant(config):
    with pytest.raises(InputError, match="config: there is no key 'polcy'; is 'policy' meant?"):
        check(config | {"polcy": "random"}, SCHEMA)


@pytest.mark.parametrize(
    "text, said",
    [("a: [1", "not YAML .*line"), ("", "holds no keys"), ("- a", "holds no keys"), (None, "not readable")],
)
def test_a_config_file_that_cannot_be_read_is_named(tmp_path, text, said):
    if text is not None:
        (tmp_path / "a.yaml").write_text(text)
    with pytest.raises(InputError, match=f"a.yaml: {said}"):
        read([tmp_path / "a.yaml"])


@pytest.mark.parametrize(
    "change, said",
    [
        pytest.param({"scene": "given"}, "complete: given is a finished field.*set complete: false", id="no photos"),
        pytest.param(
            {"prior": "other"}, r"complete: the prior other knows neither .*\(terrain.* in priors\)", id="no depth"
        ),
        pytest.param({"prior": "none"}, "prior: there is no 'none'", id="no prior"),
        pytest.param({"complete": "yes"}, "complete: 'yes' is not of type 'boolean'", id="no boolean"),
    ],
)
def test_what_cannot_be_completed_is_refused_and_why(config, change, said):
    given = {"kind": "field", "field": "a.ply", "quality": "draft", "seam": "semantic"}
    other = {"model": "zero123", "folder": "a", "samples": 2, "steps": 2}
    config["scenes"]["given"], config["priors"]["other"] = given, other
    check(config | {"complete": True}, SCHEMA)
    check(config | {"scene": "given"}, SCHEMA)
    with pytest.raises(InputError, match=said):
        check(config | {"complete": True} | change, SCHEMA)


def test_refined_tiles_have_a_name_of_their_own_where_it_is_said_how(config):
    refine = {"prior": "terrain", "strength": 0.2}
    for key in ("seam_study", "perceptual_study", "sweeps", "study", "tradeoff", "auto"):
        config.pop(key, None)
    config["seams"] = {"plain": {"tile": 0.5, "strip": 0.125, "candidates": 24, "variants": 1}}
    for scene in config["scenes"].values():
        scene["seam"] = "plain"
    config["scenes"][config["scene"]]["seam"] = "plain-refined"
    with pytest.raises(InputError, match="there is no 'plain-refined'; seams has plain$"):
        check(config, SCHEMA)
    config["seams"]["plain"]["refine"] = refine
    check(config, SCHEMA)
    config["seams"]["plain-refined"] = config["seams"]["plain"]
    with pytest.raises(InputError, match="seams.plain-refined: names that end in -refined"):
        check(config, SCHEMA)
