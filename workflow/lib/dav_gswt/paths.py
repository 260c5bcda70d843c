"""The result tree: the one place that encodes settings into paths and decodes them again.

A setting stands in the path at the stage where it first matters, so two runs that agree on the first stages share their
files. Read by the workflow before the first job, so it imports nothing heavy.
"""

import re
from collections.abc import Mapping
from decimal import Decimal
from pathlib import Path

from dav_gswt.views.policies import POLICY_NAME, PRIOR_POLICIES, ZERO_SETTINGS, resolve_policy

RESULTS = "results"
# Directories beside the scenes' own; no scene may have such a name.
RESERVED = ("logs", "benchmarks", "snapshots", "weights", "sweeps", "tables", "gallery", "latest")
SNAPSHOTS = f"{RESULTS}/snapshots"  # photos on disk while a large set is fitted: outside the outputs

# One directory level a stage, which names only the settings that the stage adds. <name> stands for another entry.
TREE = {
    "logs": "results/logs",
    "benchmarks": "results/benchmarks",
    "frames": "{scene}/frames",
    "photos": "{scene}/photos",
    "start": "{scene}/seed{seed}",
    "fit": "{scene}/seed{seed}/{preset}",
    "coarse": "<fit>/coarse",
    "scored": "<coarse>/scores_{prior}_pdrop{p_drop}",
    "active": "<fit>/active_{policy}_{prior}_pdrop{p_drop}_lam{lam}_k{k}",
    "external": "<fit>/active_external_none_pdrop0_lam0_k0/iter0",
    "round": "<active>/iter{t}",
    "materials": "<round>{inpainted}/materials",
    "levels": "<round>{inpainted}/levels",
    "tiles": "<round>{inpainted}/tiles_{tiling}",
    "bundle": "<tiles>/bundle_tau{tau}",
    "terrain": "<bundle>/terrain",
    "seams": "<bundle>/seams",
}

NAME = rf"(?!(?:{'|'.join(RESERVED)})(?:/|$))[A-Za-z][A-Za-z0-9_-]*"
NATURAL = r"0|[1-9]\d*"
POSITIVE = r"[1-9]\d*"
FRACTION = r"0|1|0\.\d*[1-9]"
SHARE = r"0|0\.\d*[1-9]"
NUMBER = r"0|[1-9]\d*|(?:0|[1-9]\d*)\.\d*[1-9]"
INPAINTED = r"(?:/inpainted_[A-Za-z][A-Za-z0-9_-]*)?"  # or nothing
WILDCARDS = {
    "scene": NAME,
    "seed": NATURAL,
    "preset": NAME,
    "policy": POLICY_NAME,
    "prior": r"[A-Za-z][A-Za-z0-9_-]*?",
    "p_drop": SHARE,
    "lam": NUMBER,
    "k": NATURAL,
    "t": NATURAL,
    "inpainted": INPAINTED,
    "tiling": NAME,
    "tau": FRACTION,
}
_EXTERNAL = dict(policy="external", prior="none", p_drop="0", lam="0", k=0, t=0, inpainted="")


def encode_number(value: int | float | str) -> str:
    """A number as it stands in paths: 0.1, never 0.10."""
    text = f"{Decimal(str(value)).normalize():f}"
    return "0" if text == "-0" else text


def encode_branch(config: Mapping, scene: str, policy: str | None = None, changes: Mapping | None = None) -> dict:
    """The wildcards of what is made of a scene, by the config or by settings that replace some of the config's.

    Settings that a policy does not read are always encoded as prior `none`, `p_drop` and `lam` 0. Where all photos
    start and no others can be taken (`agent: replay` without `start`), there are no rounds.
    """
    settings = {**config, **(changes or {})}
    entry = config["scenes"][scene]
    fit = {"scene": scene, "seed": config["seeds"], "preset": settings.get("preset", entry["preset"])}
    tiles = {
        "inpainter": config["prior"],
        "tiling": settings.get("tiling", entry["tiling"]),
        "tau": encode_number(settings["tau"]),
    }
    if entry["kind"] == "field":
        return fit | _EXTERNAL | tiles
    policy = resolve_policy(policy or settings["policy"], entry.get("agent"))
    unread = ZERO_SETTINGS.get(policy, ()) if policy in PRIOR_POLICIES else ("p_drop", "lam")
    numbers = {key: "0" if key in unread else encode_number(settings[key]) for key in ("p_drop", "lam")}
    all_start = entry.get("agent") == "replay" and "start" not in entry
    rounds = {"k": settings["k"], "t": 0 if all_start else settings["rounds"]}
    rounds["inpainted"] = f"/inpainted_{config['prior']}" if config["inpaint"] else ""  # a level below the round
    prior = settings["prior"] if policy in PRIOR_POLICIES else "none"
    return fit | {"policy": policy, "prior": prior} | numbers | rounds | tiles


def fits_windows(config: Mapping, scene: str, preset: str | None = None) -> bool:
    """Whether the last fit is of windows of the ground alone: those that tiles are cut from.

    It needs a preset that chooses with another one, whose field says where they are. Ground that is tiled as one, or
    painted where no photo saw it, is fitted whole. preset: None: one that chooses so.
    """
    entry = config["scenes"][scene]
    chooses = preset is None or bool(config["presets"][preset].get("choose_with"))
    focused = entry.get("exemplar") == "focus" and entry["materials"] != "one"
    return chooses and focused and not config["inpaint"]


def stage_template(stage: str) -> str:
    """The path of a stage below results/ with its wildcards: {scene}/seed{seed}/..."""
    template = TREE[stage]
    while match := re.search(r"<(\w+)>", template):
        template = template.replace(match[0], TREE[match[1]])
    return template


def stage_folder(stage: str, wildcards: Mapping) -> Path:
    """The folder of a stage. `wildcards`: as `encode_branch` gives them, of one seed."""
    return Path(RESULTS, stage_template(stage).format(**wildcards))


def decode_path(path: Path | str) -> dict[str, str]:
    """The wildcards of a path in the result tree; {} where it has none.

    The longest stage that leads to the path is decoded. The path may lie anywhere; `results` need not be part of it.
    """
    match = _match_stage(path)
    return match.groupdict() if match else {}


def related_folder(path: Path | str, stage: str, **changes: object) -> Path:
    """The folder of another stage in the tree that a path lies in.

    changes: wildcards that differ from the path's.
    Raises: ValueError: the path lies in no result tree. KeyError: it lacks a wildcard of the stage.
    """
    match = _match_stage(path)
    if not match:
        raise ValueError(f"{path}: lies in no result tree")
    root = Path(match.string[: match.start()] or ("/" if match.string.startswith("/") else "."))
    return root / stage_template(stage).format(**match.groupdict() | changes)


def _match_stage(path: Path | str) -> re.Match | None:
    text = Path(path).as_posix()
    matches = (_stage_pattern(stage).search(text) for stage in reversed(TREE) if "{" in stage_template(stage))
    return next((match for match in matches if match), None)


def _stage_pattern(stage: str) -> re.Pattern:
    parts, seen = [], set()
    for literal, wildcard in re.findall(r"([^{]*)(?:\{(\w+)\})?", stage_template(stage)):
        parts.append(re.escape(literal))
        if wildcard:
            parts.append(f"(?P={wildcard})" if wildcard in seen else f"(?P<{wildcard}>{WILDCARDS[wildcard]})")
            seen.add(wildcard)
    return re.compile(rf"(?:^|/){''.join(parts)}(?=/|$)")


def policy_pattern(policy: str) -> str:
    """A constraint: the policy, followed by prior, p_drop and lam as paths of this policy have them."""
    if policy not in PRIOR_POLICIES:
        return f"{policy}(?=_none_pdrop0_lam0_)"
    zeros = ZERO_SETTINGS.get(policy, ())
    p_drop, lam = ("0" if key in zeros else "[^_]+" for key in ("p_drop", "lam"))
    return f"{policy}(?!_none_)(?=_[A-Za-z0-9_-]+_pdrop{p_drop}_lam{lam}_)"
