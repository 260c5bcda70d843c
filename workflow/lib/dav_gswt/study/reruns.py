"""Which rules run again when a key of the config changes.

docs/reference/reruns.md is made from it, and tests/workflow/test_reruns.py holds the workflow to it.
"""

from collections.abc import Iterable

from pydantic import BaseModel

from dav_gswt.config.base import get_extra, is_read
from dav_gswt.config.model import Config
from dav_gswt.config.scenes import SCENES, SerialRig
from dav_gswt.config.settings import Preset, Tiling

_SPLIT_READERS = ["fit_coarse", "evaluate_coarse", "score_coarse", "select_poses", "capture_views", "request_views"]
_SPLIT_READERS += ["update_field", "fit_chosen_photos", "evaluate_round", "score_round", "inpaint_field"]
_SPLIT_READERS += ["evaluate_inpainted"]
_PHOTO_READERS = ["report_photos", "split_views", *_SPLIT_READERS, "bundle_tiles", "make_page"]
_CAPTURE_READERS = ["update_field", "copy_chosen_photos", "fit_chosen_photos", "evaluate_round", "score_round"]
_CAPTURE_READERS += ["inpaint_field", "bundle_tiles", "make_page"]
_FIELD_READERS = ["evaluate_round", "score_round", "inpaint_field", "evaluate_inpainted"]
_FIELD_READERS += ["find_materials", "make_levels", "make_page"]

# the rules of the product in their order; of each those that read what it makes
READERS: dict[str, list[str]] = {
    "register_photos": _PHOTO_READERS,
    "render_photos": _PHOTO_READERS,
    "import_field": ["prepare_external_field", "bundle_tiles"],
    "report_photos": [],
    "split_views": [*_SPLIT_READERS, "make_page"],
    "convert_lpips_weights": ["evaluate_coarse", "evaluate_round", "evaluate_inpainted", "cut_tiles"],
    "fit_coarse": ["evaluate_coarse", "score_coarse", "select_poses", "update_field"],
    "evaluate_coarse": ["make_page"],
    "score_coarse": ["select_poses", "score_round"],
    "select_poses": ["capture_views", "request_views", "evaluate_round"],
    "capture_views": _CAPTURE_READERS,
    "request_views": _CAPTURE_READERS,
    "copy_chosen_photos": ["fit_chosen_photos"],
    "update_field": [*_FIELD_READERS, "fit_chosen_photos"],
    "fit_chosen_photos": _FIELD_READERS,
    "evaluate_round": ["make_page"],
    "score_round": [],  # a later round follows from it
    "prepare_external_field": ["make_levels"],
    "inpaint_field": ["evaluate_inpainted", "find_materials", "make_levels"],
    "evaluate_inpainted": [],
    "fetch_mobilesam": ["find_materials"],
    "find_materials": ["make_levels", "cut_tiles", "bundle_tiles"],
    "make_levels": ["cut_tiles", "bundle_tiles"],
    "cut_tiles": ["bundle_tiles"],
    "bundle_tiles": ["make_page", "render_terrain", "render_flight"],
    "make_page": [],
    "render_terrain": ["make_page", "make_contact_sheet"],
    "make_contact_sheet": [],
    "render_flight": [],
}
_CHOSEN = ("copy_chosen_photos", "fit_chosen_photos")  # with `choose_with` in the preset
_DEVICES = ("serial", "plan", "handheld")
_AGENTS: dict[str, tuple[str, ...]] = {
    "synthetic": ("render", "replay"),
    "photos": ("replay", *_DEVICES),
    "field": ("",),  # none
}
_SOURCES = {"synthetic": "render_photos", "photos": "register_photos", "field": "import_field"}

# keys that stand in paths, choose inputs or are parameters by themselves: the rules that they reach first
_TOP_LEVEL: dict[str, tuple[str, ...]] = {
    "seeds": ("split_views",),
    "policy": ("select_poses",),
    "prior": (),
    "p_drop": (),
    "lam": (),
    "rounds": ("select_poses",),
    "k": ("select_poses",),
    "stop": ("select_poses",),
    "inpaint": ("inpaint_field",),
    "levels": ("make_levels",),
    "tau": ("bundle_tiles",),
    "lpips": ("convert_lpips_weights",),
    "segmenter": ("find_materials",),
    "heights": ("make_page", "render_terrain", "render_flight"),
    "classes": ("make_page", "render_terrain", "render_flight"),
    "stills": ("render_terrain", "render_flight"),
    "flight": ("render_flight",),
    "export": (),
}
_TABLES = ("scene", "scenes", "priors", "presets", "tilings", "study")  # whose keys have rows of their own, or none

HEAD = """# What a changed key makes again

Made from `workflow/lib/dav_gswt/study/reruns.py` and `read_by` of the keys in `workflow/lib/dav_gswt/config/` by
`make reference`; a test plans a finished run again with each key changed. A rule is given the keys that it reads and no
others, so a change makes again what reads it, and what follows from that. Everything else stays.

The tables are of a policy that reads no prior, as the default. With a policy that reads one, `prior`, `p_drop` and the
keys of `priors.<name>` also make the scores again (`score_coarse`, `score_round`) and what follows from them, `lam` and
`lpips` what is chosen by them, and the levels follow from the scores. With `inpaint: true`, `inpaint_field` and
`evaluate_inpainted` run after the last round; of the prior's keys they read `model`, `weights`, `samples` and `steps`.
A key that stands in a path (`preset`, `tiling`, `seeds`, `policy`, `k`, ...) leaves the old files beside the new ones.
Exports are asked for by their paths: `export_terrain`, `export_ground` and `convert_plys` run again with what they read
of `export`, the first two also with `heights` and `classes`.
With `choose_with` in the scene's preset the rules to `update_field` are those of the preset that it names.
`copy_chosen_photos` and `fit_chosen_photos` follow from these; of the scene's own preset they read what `fit_coarse`
reads of another.
`segmenter` is read where a scene has `materials: auto`: `find_materials` and what follows from it, and with `fetch`
`fetch_mobilesam` before it. `render_flight` runs where the config has a `flight`. The tables are of one round: all
rounds after one that runs again run again too.
"""


def follow_rules(first: Iterable[str], scope: Iterable[str] = tuple(READERS)) -> list[str]:
    """Some rules and all that follow from them, in the order of READERS. scope: the rules that there are."""
    known, found, ahead = set(scope), set(), list(first)
    while ahead:
        if (rule := ahead.pop()) in known and rule not in found:
            found.add(rule)
            ahead += READERS[rule]
    return [rule for rule in READERS if rule in found]


def list_rules(kind: str, agent: str) -> list[str]:
    """The rules that a scene of a kind goes through, without those that the default config does not ask for."""
    optional = {
        "convert_lpips_weights",
        "fetch_mobilesam",
        "find_materials",
        "inpaint_field",
        "evaluate_inpainted",
        "render_flight",
        *_CHOSEN,
    }
    if kind == "photos":
        optional.remove("find_materials")
    left_out = {"request_views" if agent not in _DEVICES else "capture_views"}
    left_out |= set(_SOURCES.values()) - {_SOURCES[kind]}
    if kind == "field":
        left_out |= {"report_photos", "split_views", *_SPLIT_READERS}
    else:
        left_out |= {"prepare_external_field"}
    return [rule for rule in READERS if rule not in left_out | optional]


def list_scene_reruns(kind: str, agent: str, key: str) -> list[str]:
    """The rules that run again when a key of a scene's entry changes.

    key: `size`, or `rig.limits` of a table in it. agent: the one before the change.
    """
    scope = list_rules(kind, agent)
    if key == "preset":
        return follow_rules(["fit_coarse", "prepare_external_field"], scope)
    if key == "tiling":
        return follow_rules(["cut_tiles"], scope)
    if key == "materials":  # switched on, or off
        if kind == "photos":
            return follow_rules(["make_levels"], scope)
        return follow_rules(["find_materials"], [*scope, "find_materials"])
    if key in ("kind", "field"):
        return follow_rules([_SOURCES[kind]], scope)
    return follow_rules([rule for rule in scope if is_read(SCENES[kind], rule, key, agent)], scope)


def list_preset_reruns(kind: str, key: str) -> list[str]:
    """The rules that run again when a key of the preset changes."""
    scope = list_rules(kind, _AGENTS[kind][0])
    if key == "choose_with" and kind != "field":  # another preset's rounds
        return follow_rules(["fit_coarse"], [*scope, *_CHOSEN])
    return follow_rules(get_extra(Preset.model_fields[key], "read_by"), scope)


def list_tiling_reruns(kind: str, key: str) -> list[str]:
    """The rules that run again when a key of the tiling changes."""
    assert key in Tiling.model_fields
    return follow_rules(["cut_tiles"], list_rules(kind, _AGENTS[kind][0]))


def list_top_level_reruns(kind: str, key: str) -> list[str]:
    """The rules that run again, or for the first time, when a key of the top level changes."""
    scope, first = list_rules(kind, _AGENTS[kind][0]), _TOP_LEVEL[key]
    if kind == "field":  # a finished field has no rounds
        first = {
            "seeds": ("prepare_external_field",),
            "policy": (),
            "rounds": (),
            "k": (),
            "stop": (),
            "inpaint": (),
        }.get(key, first)
    more = {
        "lpips": ["convert_lpips_weights"],
        "inpaint": ["inpaint_field", "evaluate_inpainted"],
        "flight": ["render_flight"],
    }
    return follow_rules(first, [*scope, *more.get(key, [])])


def describe_reruns() -> str:
    """The page docs/reference/reruns.md."""
    top = {key: list_top_level_reruns("synthetic", key) for key in Config.model_fields if key not in _TABLES}
    parts = [HEAD, "## Top level", _describe_rows(top)]
    for kind, model in SCENES.items():
        for agents, keys in _group_agents(kind, model):
            asked = f", agent {' or '.join(f'`{agent}`' for agent in agents)}" if agents != ("",) else ""
            parts += [f"## A scene of kind `{kind}`{asked}", _describe_rows(keys)]
    preset = {key: list_preset_reruns("synthetic", key) for key in Preset.model_fields}
    tiling = {key: list_tiling_reruns("synthetic", key) for key in Tiling.model_fields}
    parts += ["## The scene's preset", _describe_rows(preset), "## The scene's tiling", _describe_rows(tiling)]
    return "\n\n".join(part.strip() for part in parts) + "\n"


def _group_agents(kind: str, model: type[BaseModel]) -> list[tuple[tuple[str, ...], dict[str, list[str]]]]:
    """The agents of a kind, those together that every key's rules are the same for."""
    groups: list[tuple[tuple[str, ...], dict[str, list[str]]]] = []
    for agent in _AGENTS[kind]:
        names = [name for key in model.model_fields for name in _expand_rig(key)]
        keys = {name: list_scene_reruns(kind, agent, name) for name in names}
        if groups and groups[-1][1] == keys:
            groups[-1] = (*groups[-1][0], agent), keys
        else:
            groups.append(((agent,), keys))
    return groups


def _expand_rig(key: str) -> list[str]:
    """The keys of a rig one by one: not all of them are read where poses are scored."""
    return [f"rig.{name}" for name in SerialRig.model_fields] if key == "rig" else [key]


def _describe_rows(keys: dict[str, list[str]]) -> str:
    """A row for the keys that have the same rules."""
    by_rules: dict[tuple[str, ...], list[str]] = {}
    for key, rules in keys.items():
        by_rules.setdefault(tuple(rules), []).append(key)
    rows = [
        f"| {', '.join(f'`{name}`' for name in names)} | {', '.join(f'`{rule}`' for rule in rules) or 'nothing'} |"
        for rules, names in by_rules.items()
    ]
    return "\n".join(["| key | runs again |", "|---|---|", *rows])
