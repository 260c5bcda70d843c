"""The keys of scenes and presets that each rule reads: a change of any other key makes nothing of it again.

Read by the workflow before the first job, so it imports nothing heavy.
"""

from collections.abc import Iterable, Mapping
from typing import Any

from dav_gswt.errors import InputError


class EntryKeys(dict):
    """Some keys of an entry of the config. To read another key is an error: it would have its default unnoticed.

    Attributes:
        allowed: the keys that may be read, whether the entry has them or not.
    """

    def __init__(self, entry: Mapping[str, Any], keys: Iterable[str]):
        """keys: `rig` is the whole table, `rig.limits` one of its keys."""
        nested: dict[str, list[str]] = {}
        whole = []
        for key in keys:
            table, _, rest = key.partition(".")
            nested.setdefault(table, []).append(rest) if rest else whole.append(key)
        super().__init__({key: entry[key] for key in whole if key in entry})
        self.update({key: EntryKeys(entry[key], inner) for key, inner in nested.items() if key in entry})
        self.allowed = frozenset([*whole, *nested])

    def __missing__(self, key: str) -> Any:
        self._require_allowed(key)
        raise KeyError(key)

    def __contains__(self, key: object) -> bool:
        self._require_allowed(key)
        return super().__contains__(key)

    def get(self, key: str, default: Any = None) -> Any:
        self._require_allowed(key)
        return super().get(key, default)

    def _require_allowed(self, key: object) -> None:
        if key not in self.allowed:
            raise LookupError(f"the rule is not given the key {key!r}: name it in dav_gswt.config.rule_keys")


_POSES = ("candidates", "min_elevation", "poses")  # for devices and people
_RENDERED_POSES = (*_POSES, "size")
_REACH = tuple(f"rig.{key}" for key in ("millimetres", "pan_zero", "tilt_zero", "limits", "no_go"))
_CANDIDATES = {"render": _RENDERED_POSES, "replay": (), "serial": _POSES, "plan": _POSES, "handheld": _POSES}
_SCORED = {
    "render": (*_RENDERED_POSES, "feasibility"),
    "replay": (),
    "serial": (*_POSES, "feasibility", *_REACH),
    "plan": (*_POSES, "feasibility", "drone.min_altitude"),
    "handheld": (*_POSES, "feasibility"),
}
_DEVICES = {"render": ("family", "seed"), "replay": (), "serial": ("rig",), "plan": ("drone",), "handheld": ()}
_SELECTED = {agent: (*keys, "burst") for agent, keys in _CANDIDATES.items()}
_CAPTURED = {agent: (*keys, *_DEVICES[agent]) for agent, keys in _SELECTED.items()}
_RENDERED = ("family", "seed", "photos", "layout", "min_elevation", "size", "test", "oblique", "walkers")

# of a scene, by rule; where they depend on the scene's agent, by agent, and `agent` itself is one of them
SCENE_KEYS: dict[str, tuple[str, ...] | dict[str, tuple[str, ...]]] = {
    "register_photos": ("folder", "model", "masks", "size", "sfm", "mapper", "cameras", "focal", "verdict"),
    "render_photos": _RENDERED,
    "import_field": ("up",),
    "split_views": ("start", "photos", "whole"),
    "fit_coarse": ("whole",),
    "update_field": ("whole",),
    "fit_chosen_photos": ("whole",),
    "score_coarse": _SCORED,
    "score_round": _SCORED,
    "select_poses": _SELECTED,
    "capture_views": _CAPTURED,
    "request_views": _CAPTURED,
    "render_candidates": {"render": (*_RENDERED_POSES, "family", "seed")},
    "calibrate_coarse": _CANDIDATES,
    "calibrate_round": _CANDIDATES,
}

_COARSE = ("size", "spacing", "max_gaussians", "steps", "steps_per_photo", "sh_degree")
_ALL_FITS = (*_COARSE, "update", "choose_with")

# of a preset, by rule; metrics.json records what its field was fitted with
PRESET_KEYS: dict[str, tuple[str, ...]] = {
    "fit_coarse": _COARSE,
    "evaluate_coarse": _COARSE,
    "prepare_external_field": ("max_gaussians",),
    "update_field": (*_COARSE, "update"),
    "fit_chosen_photos": _COARSE,
    "evaluate_round": _ALL_FITS,
    "evaluate_at": _ALL_FITS,
    "evaluate_inpainted": _ALL_FITS,
    "make_levels": ("level_steps", "levels"),
}

# of a prior, for the rules that read less than all of it
PRIOR_KEYS = {"inpaint_field": ("model", "samples", "steps", "weights")}

_AREA = ("columns", "rows", "centre", "corner", "radius")

# of the table `export`, by rule
EXPORT_KEYS: dict[str, tuple[str, ...]] = {
    "export_terrain": (*_AREA, "level", "formats", "axes", "spz_version", "tile_compression", "max_gb"),
    "export_ground": (*_AREA, "surface", "mesh_error"),
}


def select_scene_keys(rule: str, scene: Mapping[str, Any]) -> EntryKeys:
    """What a rule reads of a scene's entry. Raises: InputError: the rule does not serve the scene's agent."""
    keys = SCENE_KEYS[rule]
    if isinstance(keys, dict):
        agent = scene["agent"]
        if agent not in keys:
            raise InputError(f"rule {rule} serves no scene with agent {agent}, only {', '.join(keys)}")
        keys = ("agent", *keys[agent])
    return EntryKeys(scene, keys)


def select_preset_keys(rule: str, preset: Mapping[str, Any]) -> EntryKeys:
    """What a rule reads of a preset."""
    return EntryKeys(preset, PRESET_KEYS[rule])


def select_export_keys(rule: str, export: Mapping[str, Any]) -> EntryKeys:
    """What a rule reads of `export`."""
    return EntryKeys(export, EXPORT_KEYS[rule])
