"""Which settings the config's `tradeoff` compares, and the named entries that it makes of them.

A knob turns one key of an entry of `presets`, `tilings` or `priors`; the workflow knows entries by their names only, so
each setting becomes an entry of its own: the max_gaussians 70000 of the preset draft is draft-max_gaussians-70000.
Read by the workflow before the first job, so it loads no numerics.
"""

from collections.abc import Iterator
from dataclasses import dataclass

from dav_gswt.errors import InputError
from dav_gswt.paths import encode_number
from dav_gswt.views.policies import PRIOR_POLICIES

CALLED = {"presets": "preset", "tilings": "tiling", "priors": "prior"}  # how what is chosen calls an entry of a table
LEFT_OUT = {"levels": "auto"}  # what a key means where an entry has none
PRESET = "preset"  # the knob of the named presets


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
    asked = config.get("tradeoff")
    return [setting for each in _list_knobs(asked) for setting in _list_of_knob(config, *each)] if asked else []


def find_test_size(config: dict) -> int:
    """The size of the photos that all settings are tested on: the largest that one is fitted to. config: `entries`'."""
    return max(config["presets"][setting.chosen["preset"]]["size"] for setting in list_settings(config))


def add_entries(config: dict) -> dict:
    """The config with the entries that its `tradeoff` names; what it holds already stays as it is.

    Raises: InputError: the config has another entry of such a name.
    """
    made = {table: dict(config[table]) for table in CALLED}
    for table, entry, below, key, value in _list_entries(config):
        found = config[table][below] | {key: value}
        if made[table].setdefault(entry, found) != found:
            raise InputError(f"config: {table}.{entry}: `tradeoff` makes an entry of this name; give yours another")
    return config | made


def check_tradeoff(config: dict) -> None:
    """Check `tradeoff` against the rest of the config.

    Raises: InputError: the key, what is wrong with it, and what it may be.
    """
    if not (asked := config.get("tradeoff")):
        return
    if config["scenes"].get(asked["scene"], {"kind": "field"})["kind"] == "field":
        able = ", ".join(n for n, s in config["scenes"].items() if s["kind"] != "field")
        raise InputError(f"config: tradeoff: {asked['scene']} is no scene with photos; they are {able}")
    _check_names("tradeoff.base", asked["base"], config)
    for preset in asked["presets"]:
        _check_names("tradeoff.presets", {"preset": preset}, config)
    for knob in asked.get("only", []):
        if knob not in asked["knobs"]:
            raise InputError(f"config: tradeoff.only: there is no knob {knob!r}; knobs has {', '.join(asked['knobs'])}")
    for knob, turned in asked["knobs"].items():
        where, base = f"tradeoff.knobs.{knob}", asked["base"] | turned.get("base", {})
        _check_names(f"{where}.base", turned.get("base", {}), config)
        if turned.get("of") == "priors" and base["policy"] not in PRIOR_POLICIES:
            raise InputError(
                f"config: {where}: makes no difference to the policy {base['policy']}, which asks no prior; "
                "give it one that does, as base: {policy: w2-lpips}"
            )


def _check_names(where: str, chosen: dict, config: dict) -> None:
    for table, called in CALLED.items():
        if called in chosen and chosen[called] not in config[table]:
            known = ", ".join(config[table]) or "nothing"
            raise InputError(f"config: {where}: there is no {called} {chosen[called]!r}; {table} has {known}")


def _list_knobs(asked: dict) -> Iterator[tuple[str, dict]]:
    yield PRESET, {"key": "preset", "values": asked["presets"], "measure": "views"}
    for knob in asked.get("only", asked["knobs"]):
        yield knob, asked["knobs"][knob]


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
    return config[turned["of"]][base[called]].get(key, LEFT_OUT.get(key, "")) if "of" in turned else base[called]


def _list_entries(config: dict) -> Iterator[tuple[str, str, str, str, int | float | str]]:
    """Table, name, the entry below, key and value of every entry that is made."""
    for knob, turned in config.get("tradeoff", {"knobs": {}})["knobs"].items():
        if table := turned.get("of"):
            base, called, key = _resolve_knob(config, knob, turned)
            usual = _encode_value(_own_value(config, knob, turned))
            for value in (value for value in turned["values"] if _encode_value(value) != usual):
                yield table, name_entry(base[called], key, value), base[called], key, value


def _encode_value(value: int | float | str) -> str:
    return value if isinstance(value, str) else encode_number(value)
