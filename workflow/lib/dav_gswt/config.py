"""The config is closed: what is misspelt or out of range is named before the first job starts."""

from difflib import get_close_matches
from pathlib import Path

import yaml
from jsonschema import Draft202012Validator
from jsonschema.exceptions import ValidationError, best_match

from dav_gswt.errors import InputError
from dav_gswt.study.sweeps import grid
from dav_gswt.study.tables import checks as tables
from dav_gswt.study.tradeoff import settings

FLOOR = "floor"  # in a pair of the perceptual study: the same place without a seam
REFINED = "-refined"  # after a seam's name: its tiles, refined as its `refine` says


def read(files: list[Path], over: dict | None = None) -> dict:
    """A config as Snakemake reads it: each file laid over the one before, key by key, and `over` on top.

    Raises: InputError: a file is missing or not YAML (with the line), or does not hold keys.
    """
    config = {}
    for file in files:
        try:
            given = yaml.safe_load(Path(file).read_text(encoding="utf-8"))
        except OSError as error:
            raise InputError(f"{file}: not readable ({error.strerror})") from error
        except (yaml.YAMLError, UnicodeDecodeError) as error:
            raise InputError(f"{file}: not YAML ({' '.join(str(error).split())})") from error
        if not isinstance(given, dict):
            raise InputError(f"{file}: holds no keys; config/config.yaml is an example")
        config = _laid_over(config, given)
    return _laid_over(config, over or {})


def _laid_over(below: dict, above: dict) -> dict:
    both = {k: _laid_over(below[k], v) if _tables(below.get(k), v) else v for k, v in above.items()}
    return below | both


def _tables(*values) -> bool:
    return all(isinstance(value, dict) for value in values)


def _said(error: ValidationError) -> str:
    if error.validator != "additionalProperties":
        return error.message
    known = error.schema["properties"]
    unknown = next(key for key in error.instance if key not in known)
    near = get_close_matches(str(unknown), known, 1)
    return f"there is no key {unknown!r}" + (f"; is {near[0]!r} meant?" if near else f", only {', '.join(known)}")


def check(config: dict, schema: Path) -> None:
    """Check a config against its schema and against itself.

    Raises: InputError: the key, what is wrong with it, and what it may be.
    """
    rules = yaml.safe_load(schema.read_text(encoding="utf-8"))
    _check_keys(config, rules)
    if config["scene"] not in config["scenes"]:
        raise InputError(f"config: scene: there is no {config['scene']!r}; scenes has {', '.join(config['scenes'])}")
    if config["prior"] not in config["priors"]:
        known = ", ".join(config["priors"]) or "nothing"
        raise InputError(f"config: prior: there is no {config['prior']!r}; priors has {known}")
    if config["complete"]:
        _check_complete(config)
    _check_refinements(config["seams"], config["priors"])
    seams = [*config["seams"], *(name + REFINED for name, seam in config["seams"].items() if "refine" in seam)]
    for name, scene in config["scenes"].items():
        for key, table, known in (("quality", "qualities", config["qualities"]), ("seam", "seams", seams)):
            if scene[key] not in known:
                raise InputError(
                    f"config: scenes.{name}.{key}: there is no {scene[key]!r}; {table} has {', '.join(known)}"
                )
    for entry in ("lod", "frames"):
        for name in config.get(entry, {}).get("scenes", []):
            if name not in config["scenes"]:
                known = ", ".join(config["scenes"])
                raise InputError(f"config: {entry}.scenes: there is no {name!r}; scenes has {known}")
    if "benchmark" in config:
        _check_benchmark(config["benchmark"], config["scenes"], config["priors"])
    if "seam_study" in config:
        _check_seam_study(config["seam_study"], config["scenes"], config["seams"])
    if "perceptual_study" in config:
        _check_perceptual_study(config["perceptual_study"], config["scenes"], config["seams"])
    grid.check(config)
    tables.check(config)
    settings.check(config)
    _check_keys(settings.entries(config), rules)  # a knob's values are in range where the entries it makes are


def _check_keys(config: dict, rules: dict) -> None:
    if error := best_match(Draft202012Validator(rules).iter_errors(config)):
        key = ".".join(str(part) for part in error.absolute_path)
        raise InputError(f"config: {key + ': ' if key else ''}{_said(error)} (config/README.md lists every key)")


def _check_refinements(seams: dict, priors: dict) -> None:
    """Tiles are refined by a prior that takes pictures with a little noise, and no entry has a refinement's name."""
    able = [name for name, prior in priors.items() if prior["model"] == "terrain"]
    for name, seam in seams.items():
        if name.endswith(REFINED):
            raise InputError(f"config: seams.{name}: names that end in {REFINED} are those of refined tiles; rename it")
        if "refine" in seam and seam["refine"]["prior"] not in able:
            raise InputError(
                f"config: seams.{name}.refine.prior: {seam['refine']['prior']} is no prior of model terrain "
                f"({', '.join(able) or 'none is'} in priors)"
            )


def _check_complete(config: dict) -> None:
    """What no photo saw can be completed where there are photos, by a prior that knows depth."""
    if config["scenes"][config["scene"]]["kind"] == "field":
        raise InputError(
            f"config: complete: {config['scene']} is a finished field: without photos nothing tells what they did not "
            "see, and there is nothing to complete; set complete: false"
        )
    if config["priors"][config["prior"]]["model"] != "terrain":
        able = ", ".join(name for name, prior in config["priors"].items() if prior["model"] == "terrain") or "none is"
        raise InputError(
            f"config: complete: the prior {config['prior']} knows neither depth nor what is known already; set prior "
            f"to one of model terrain ({able} in priors), or complete: false"
        )


def _check_seam_study(asked: dict, scenes: dict, seams: dict) -> None:
    """What is measured is there, and so is what the others are compared with."""
    for key, table in (("scenes", scenes), ("seams", seams)):
        for name in asked[key]:
            if name not in table:
                raise InputError(f"config: seam_study.{key}: there is no {name!r}; {key} has {', '.join(table)}")
    if asked["baseline"] not in asked["seams"]:
        raise InputError(f"config: seam_study.baseline: {asked['baseline']} is not among seam_study.seams")


def _check_perceptual_study(asked: dict, scenes: dict, seams: dict) -> None:
    """The scenes are there, and both of every pair, of which only the second may be the floor."""
    for name in asked["scenes"]:
        if name not in scenes:
            raise InputError(f"config: perceptual_study.scenes: there is no {name!r}; scenes has {', '.join(scenes)}")
    used = list(dict.fromkeys(name for pair in asked["pairs"] for name in pair))
    if any(pair[0] == FLOOR for pair in asked["pairs"]):
        raise InputError(f"config: perceptual_study.pairs: {FLOOR} is the same place without a seam: name it second")
    for name in used:
        if name not in seams and name != FLOOR:
            raise InputError(
                f"config: perceptual_study.pairs: there is no {name!r}; seams has {', '.join(seams)}; "
                f"there is {FLOOR}, too"
            )


def _check_benchmark(asked: dict, scenes: dict, priors: dict) -> None:
    """Policies can be compared where every scene starts from some of its photos and all cells take at least a round."""
    if asked["baseline"] not in asked["policies"]:
        raise InputError(f"config: benchmark.baseline: {asked['baseline']} is not among benchmark.policies")
    for i, group in enumerate(asked["sets"]):
        for policy in group.get("policies", asked["policies"]):
            if not isinstance(policy, str) and policy.get("prior", next(iter(priors), None)) not in priors:
                known = ", ".join(priors) or "nothing"
                raise InputError(f"config: benchmark: there is no prior {policy['prior']!r}; priors has {known}")
        for name in group["scenes"]:
            if "start" not in scenes.get(name, {}):
                raise InputError(
                    f"config: benchmark.sets.{i}.scenes: {name} is no scene with `start`, photos to start from"
                )
            if group["photos"] < scenes[name]["start"] + max(group["k"]):
                raise InputError(
                    f"config: benchmark.sets.{i}.photos: {group['photos']} leave no round of {max(group['k'])} after "
                    f"the {scenes[name]['start']} that {name} starts from"
                )
