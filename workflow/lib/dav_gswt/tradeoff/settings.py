"""Which settings the config's `tradeoff` compares, and the named entries that it makes of them.

A knob turns one key of an entry of `qualities`, `seams` or `priors`; the workflow knows entries by their names only, so
each setting becomes an entry of its own: the cap 70000 of the quality reference is reference-cap-70000.
Read by the workflow before the first job, so it loads no numerics.
"""

from collections.abc import Iterator
from dataclasses import dataclass

from dav_gswt.active.names import IMAGINING
from dav_gswt.errors import InputError
from dav_gswt.spelling import spell

CALLED = {"qualities": "quality", "seams": "seam", "priors": "prior"}  # how what is chosen calls an entry of a table
LEFT_OUT = {"degree": 0, "levels": "auto"}  # what a key means where an entry has none
PRESET = "preset"  # the knob of the named qualities


@dataclass(frozen=True)
class Setting:
    """A setting of a knob.

    shown: its value. chosen: what a cell is made with, keys as in `sweeps.fixed`. measure: what tells its accuracy,
    views, stills or seams. most: it is the base, taken for the most accurate.
    """

    knob: str
    shown: str
    chosen: dict
    measure: str
    most: bool


def name(base: str, key: str, value: int | float | str) -> str:
    """The name of the entry that is `base` but for one value: reference-spacing-1_25. One spelling a number."""
    return f"{base}-{key}-{_spelled(value).replace('.', '_')}"


def settings(config: dict) -> list[Setting]:
    """Every setting of `tradeoff`, by knob, each knob's base first; no value comes twice."""
    asked = config.get("tradeoff")
    return [setting for each in _knobs(asked) for setting in _of_knob(config, *each)] if asked else []


def entries(config: dict) -> dict:
    """The config with the entries that its `tradeoff` names; what it holds already stays as it is.

    Raises: InputError: the config has another entry of such a name.
    """
    made = {table: dict(config[table]) for table in CALLED}
    for table, entry, below, key, value in _made(config):
        found = config[table][below] | {key: value}
        if made[table].setdefault(entry, found) != found:
            raise InputError(f"config: {table}.{entry}: `tradeoff` makes an entry of this name; give yours another")
    return config | made


def check(config: dict) -> None:
    """Check `tradeoff` and `auto` against the rest of the config.

    Raises: InputError: the key, what is wrong with it, and what it may be.
    """
    for section in ("tradeoff", "auto"):
        asked = config.get(section, {})
        for scene in [asked["scene"]] if "scene" in asked else asked.get("scenes", []):
            if config["scenes"].get(scene, {"kind": "field"})["kind"] == "field":
                able = ", ".join(n for n, s in config["scenes"].items() if s["kind"] != "field")
                raise InputError(f"config: {section}: {scene} is no scene with photos; they are {able}")
        for part in ("base", "auto"):
            _check_names(f"{section}.{part}", asked.get(part, {}), config)
    asked = config.get("tradeoff", {"knobs": {}, "presets": []})
    for quality in asked["presets"]:
        _check_names("tradeoff.presets", {"quality": quality}, config)
    for knob in asked.get("only", []):
        if knob not in asked["knobs"]:
            raise InputError(f"config: tradeoff.only: there is no knob {knob!r}; knobs has {', '.join(asked['knobs'])}")
    for knob, turned in asked["knobs"].items():
        where, base = f"tradeoff.knobs.{knob}", asked["base"] | turned.get("base", {})
        _check_names(f"{where}.base", turned.get("base", {}), config)
        if turned.get("of") == "priors" and base["policy"] not in IMAGINING:
            raise InputError(
                f"config: {where}: makes no difference to the policy {base['policy']}, which asks no prior; "
                "give it one that does, as base: {policy: w2-lpips}"
            )


def _check_names(where: str, chosen: dict, config: dict) -> None:
    for table, called in CALLED.items():
        if called in chosen and chosen[called] not in config[table]:
            known = ", ".join(config[table]) or "nothing"
            raise InputError(f"config: {where}: there is no {called} {chosen[called]!r}; {table} has {known}")


def _knobs(asked: dict) -> Iterator[tuple[str, dict]]:
    yield PRESET, {"key": "quality", "values": asked["presets"], "measure": "views"}
    for knob in asked.get("only", asked["knobs"]):
        yield knob, asked["knobs"][knob]


def _of_knob(config: dict, knob: str, turned: dict) -> list[Setting]:
    base, key = config["tradeoff"]["base"] | turned.get("base", {}), turned.get("key", knob)
    if table := turned.get("of"):
        called = CALLED[table]
        first = config[table][base[called]].get(key, LEFT_OUT.get(key, ""))
    else:
        called, first = key, base[key]
    found = {_spelled(first): Setting(knob, _spelled(first), base, turned["measure"], True)}
    for value in turned["values"]:
        chosen = base | {called: name(base[called], key, value) if table else value}
        found.setdefault(_spelled(value), Setting(knob, _spelled(value), chosen, turned["measure"], False))
    return list(found.values())


def _made(config: dict) -> Iterator[tuple[str, str, str, str, int | float | str]]:
    """Table, name, the entry below, key and value of every entry that is made."""
    asked = config.get("tradeoff", {"knobs": {}})
    for knob, turned in asked["knobs"].items():
        if table := turned.get("of"):
            below, key = (asked["base"] | turned.get("base", {}))[CALLED[table]], turned.get("key", knob)
            for value in turned["values"]:
                yield table, name(below, key, value), below, key, value


def _spelled(value: int | float | str) -> str:
    return value if isinstance(value, str) else spell(value)
