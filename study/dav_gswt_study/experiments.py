"""Which cells the study's tables are made from, and the named entries of the config that some of them need.

A sweep has a cell for every combination of what it varies. The workflow knows entries of `presets`, `tilings`
and `priors` by their names only. Therefore each setting that the trade-off turns, and each replicate of a tiling,
becomes an entry of its own: draft-max_gaussians-70000, semantic-replicate-1. The workflow reads this before the
first job, so it loads no numerics.
"""

from dataclasses import dataclass
from itertools import product

from dav_gswt.paths import encode_number

EVERYTHING = "all"  # the policy that takes the whole pool in one round
EXPANSION = "-expansion"  # of tilings that the study makes of an entry of `tilings`
CALLED = {"presets": "preset", "tilings": "tiling", "priors": "prior"}  # how what is chosen calls an entry of a table
PRESET = "preset"  # the knob of the named presets


def list_combinations(vary: dict[str, list], fixed: dict) -> list[dict]:
    """The settings of every combination, in the order they stand in: `fixed`, and a value of each of `vary` over it.

    `shown` holds the values of `vary` alone.
    """
    combined = (dict(zip(vary, values, strict=True)) for values in product(*vary.values()))
    return [fixed | values | {"shown": values} for values in combined]


def count_rounds(chosen: dict, policy: str, start: int, k: int, rounds: int) -> int:
    """How many rounds a cell takes: those asked for, or as many of k as `photos` of `chosen` have room for.

    The policy that takes everything has one round, whatever is asked.
    """
    if "photos" in chosen:
        rounds = (chosen["photos"] - start) // k
    return min(rounds, 1) if policy == EVERYTHING else rounds


def list_seeds(measure: dict[str, list[int]]) -> list[int]:
    """All seeds of which anything is measured."""
    return sorted({seed for seeds in measure.values() for seed in seeds})


def count_start_photos(scene: dict) -> int:
    """Photos that a scene starts from."""
    return scene["start"] if "start" in scene else scene["photo_count"]


def split_tiling(tiling: str) -> tuple[str, str]:
    """The entry of `tilings` that a tiling is made of, and the suffix that says how."""
    plain = tiling.removesuffix(EXPANSION)
    return plain, tiling.removeprefix(plain)


def name_replicate(tiling: str, number: int) -> str:
    """The name of a replicate; replicate 0 is the tiling itself."""
    plain, suffix = split_tiling(tiling)
    return f"{plain}-replicate-{number}{suffix}" if number else tiling


def list_replicates(tiling: str, own: str, study: dict) -> list[str]:
    """All replicates of a tiling that `study.seams` asks for of a scene whose own tiling is `own`."""
    counts = [study["replicates"]] * (tiling == own) + [study["compared_replicates"]] * (tiling in study["tilings"])
    return [name_replicate(tiling, number) for number in range(max(counts, default=0))]


def add_replicates(config: dict) -> dict:
    """The config with the tilings that `study.seams` replicates: every scene's own, and those it compares.

    config: with the study's tables beside the product's.
    """
    if "seams" not in config:
        return config
    study, tilings = config["seams"], dict(config["tilings"])
    owned = dict.fromkeys(config["scenes"][scene]["tiling"] for scene in study["scenes"])
    for own, tiling in product(owned, [*owned, *study["tilings"]]):
        for number, replicate in enumerate(list_replicates(tiling, own, study)):
            plain, name = split_tiling(tiling)[0], split_tiling(replicate)[0]
            tilings.setdefault(name, config["tilings"][plain] | ({"replicate": number} if number else {}))
    return config | {"tilings": tilings}


@dataclass(frozen=True)
class Setting:
    """A setting of a knob.

    shown: its value. chosen: what a cell is made with, keys as in `sweeps.fixed`. measure: what tells its accuracy,
    views, stills or seams. most: taken for the knob's most accurate. base: the base's own.
    """

    knob: str
    shown: str
    chosen: dict
    measure: str
    most: bool
    base: bool


def name_entry(base: str, key: str, value: int | float | str) -> str:
    """The name of the entry that is `base` but for one value, equal numbers written alike: reference-spacing-1_25."""
    return f"{base}-{key}-{_encode_value(value).replace('.', '_')}"


def list_settings(config: dict) -> list[Setting]:
    """Every setting of `tradeoff`, by knob, in the config's order, each knob's most accurate first.

    The base's own value, where a knob does not name it, is its last; no value comes twice.
    """
    if not (asked := config.get("tradeoff")):
        return []
    knobs = {PRESET: {"key": "preset", "values": asked["presets"], "measure": "views"}}
    knobs |= {knob: asked["knobs"][knob] for knob in asked.get("only", asked["knobs"])}
    return [setting for knob, turned in knobs.items() for setting in _list_of_knob(config, knob, turned)]


def find_test_size(config: dict) -> int:
    """The size of the photos that all settings are tested on: the largest that one is fitted to. config: `entries`'."""
    return max(config["presets"][setting.chosen["preset"]]["fit_size"] for setting in list_settings(config))


def add_entries(config: dict) -> dict:
    """The config with the entries that its `tradeoff` names; what it holds already stays as it is."""
    made = {table: dict(config[table]) for table in CALLED}
    for knob, turned in config.get("tradeoff", {"knobs": {}})["knobs"].items():
        if table := turned.get("of"):
            base, called, key = _resolve_knob(config, knob, turned)
            usual, below = _encode_value(_own_value(config, knob, turned)), base[called]
            for value in (value for value in turned["values"] if _encode_value(value) != usual):
                made[table].setdefault(name_entry(below, key, value), config[table][below] | {key: value})
    return config | made


def _list_of_knob(config: dict, knob: str, turned: dict) -> list[Setting]:
    base, called, key = _resolve_knob(config, knob, turned)
    usual, found = _own_value(config, knob, turned), {}
    for value in [*turned["values"], usual]:
        chosen = base | {called: name_entry(base[called], key, value) if "of" in turned else value}
        own = _encode_value(value) == _encode_value(usual)
        made = Setting(knob, _encode_value(value), base if own else chosen, turned["measure"], not found, own)
        found.setdefault(made.shown, made)
    return list(found.values())


def _resolve_knob(config: dict, knob: str, turned: dict) -> tuple[dict, str, str]:
    """What a knob is turned from, how this calls what the knob changes, and the key of the entry, if it is one."""
    key = turned.get("key", knob)
    called = CALLED[turned["of"]] if "of" in turned else key
    return config["tradeoff"]["base"] | turned.get("base", {}), called, key


def _own_value(config: dict, knob: str, turned: dict) -> int | float | str:
    """The base's own value of a knob."""
    base, called, key = _resolve_knob(config, knob, turned)
    return config[turned["of"]][base[called]].get(key, "") if "of" in turned else base[called]


def _encode_value(value: int | float | str) -> str:
    return value if isinstance(value, str) else encode_number(value)
