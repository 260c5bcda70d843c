"""Which cells a row of the config's `sweeps` asks for: every combination of what is varied, over all its scenes.

Read by the workflow before the first job, so it loads no numerics.
"""

from itertools import product

from dav_gswt.errors import InputError
from dav_gswt.views.policies import PRIOR_POLICIES, ZERO_SETTINGS
from dav_gswt_study.seams.replicates import split_tiling

CELL = ("scene", "seed", "preset", "policy", "prior", "p_drop", "lam", "k", "rounds", "tiling", "tau")  # its wildcards
ASKING = ("prior", "p_drop", "lam")  # what only a prior that is asked depends on
EVERYTHING = "all"  # the policy that takes the whole pool in one round


def list_combinations(vary: dict[str, list], fixed: dict) -> list[dict]:
    """The settings of every combination, in the order they stand in: `fixed`, and a value of each of `vary` over it.

    A policy with settings of its own, {policy: w2, prior: terrain-m2, p_drop: 0}, brings these. `shown` holds
    for each of `vary` the value as tables name it. The policy that takes everything has one round, whatever is asked.
    """
    found = []
    for values in product(*vary.values()):
        chosen = dict(fixed)
        for key, value in zip(vary, values, strict=True):
            chosen |= value if isinstance(value, dict) else {key: value}
        found.append(chosen | {"shown": dict(zip(vary, map(name_value, values), strict=True))})
    return found


def name_value(value):
    """A varied value as tables name it: of a policy with settings of its own the policy."""
    return value["policy"] if isinstance(value, dict) else value


def count_rounds(chosen: dict, policy: str, start: int, k: int, rounds: int) -> int:
    """How many rounds a cell takes: those asked for, or as many of k as `photos` of `chosen` have room for."""
    if "photos" in chosen:
        rounds = (chosen["photos"] - start) // k
    return min(rounds, 1) if policy == EVERYTHING else rounds


def list_seeds(measure: dict[str, list[int]]) -> list[int]:
    """All seeds of which anything is measured."""
    return sorted({seed for seeds in measure.values() for seed in seeds})


def count_start_photos(scene: dict) -> int:
    """Photos that a scene starts from."""
    return scene["start"] if "start" in scene else scene["photos"]


def check_sweeps(config: dict) -> None:
    """Check the rows of `sweeps` against the rest of the config.

    Raises: InputError: the row and key, what is wrong with it, and what it may be.
    """
    for entry in ("lod", "frames"):
        if "fixed" in config.get(entry, {}):
            _check_names(f"config: study.{entry}", {"vary": {}} | config[entry], config)
    for name, asked in config.get("sweeps", {}).items():
        where = f"config: study.sweeps.{name}"
        if both := [key for key in asked["vary"] if key in asked.get("fixed", {})]:
            raise InputError(f"{where}.fixed.{both[0]}: is varied already; leave it out there")
        _check_names(where, asked, config)
        for chosen in list_combinations(asked["vary"], asked.get("fixed", {})):
            _check_effect(where, asked["vary"], chosen.get("policy", config["policy"]))
            _check_photos(where, asked["scenes"], chosen, config)


def _check_names(where: str, asked: dict, config: dict) -> None:
    tables = {"prior": "priors", "tiling": "tilings", "preset": "presets"}
    for key, table in tables.items():
        fixed = [asked["fixed"][key]] if key in asked.get("fixed", {}) else []
        for value in [*fixed, *asked["vary"].get(key, [])]:
            if split_tiling(value)[0] not in config[table]:
                known = ", ".join(config[table]) or "nothing"
                raise InputError(f"{where}: there is no {key} {value!r}; {table} has {known}")
    for policy in asked["vary"].get("policy", []):
        if isinstance(policy, dict) and policy.get("prior", config["prior"]) not in config["priors"]:
            known = ", ".join(config["priors"]) or "nothing"
            raise InputError(f"{where}: there is no prior {policy['prior']!r}; priors has {known}")
    for scene in asked["scenes"]:
        if config["scenes"].get(scene, {"kind": "field"})["kind"] == "field":
            able = ", ".join(n for n, s in config["scenes"].items() if s["kind"] != "field")
            raise InputError(f"{where}.scenes: {scene} is no scene with photos; they are {able}")


def _check_effect(where: str, vary: dict, policy: str) -> None:
    """What is varied must matter: two cells of one path would be one."""
    for key in ASKING:
        if key in vary and len(vary) == 1 and (policy not in PRIOR_POLICIES or key in ZERO_SETTINGS.get(policy, ())):
            raise InputError(
                f"{where}.vary.{key}: makes no difference to the policy {policy}; fix a policy that reads it, as "
                "fixed: {policy: w2-lpips}"
            )


def _check_photos(where: str, scenes: list[str], chosen: dict, config: dict) -> None:
    k = chosen.get("k", config["k"])
    for name in scenes:
        start = count_start_photos(config["scenes"][name])
        if "photos" in chosen and "rounds" in chosen:
            raise InputError(f"{where}: photos and rounds cannot both be given; leave one out")
        if chosen.get("photos", start + k) < start + k:
            raise InputError(
                f"{where}: photos: {chosen['photos']} leave no round of {k} after the {start} that {name} starts from"
            )
