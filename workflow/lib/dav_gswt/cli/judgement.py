"""What was made, in a few sentences: what was found, how good it will look and why, and what would help."""

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from dav_gswt.files import read_json
from dav_gswt.geometry.scene_frame import SceneFrame, read_scene_frame

# PSNR of photos that were set aside, after their exposure is fitted, from which a word holds
SHARPNESS = ((30.0, "shows them sharply"), (25.0, "shows them well, a little softer"), (20.0, "is soft beside them"))
WORST = "differs from them: things moved, the light changed, or photos found a wrong place"
MOST_REASONS = 3


def judge_terrain(frame: Path, materials: Path | None, metrics: Path | None) -> list[str]:
    """Sentences on a finished terrain. frame: ground.json. materials: materials.json. metrics: of the last round.

    Raises: InputError: a file is not readable.
    """
    ground = read_scene_frame(frame)
    found = read_json(materials) if materials else None
    sentences = [describe_ground(found), describe_photos(ground), describe_sharpness(metrics)]
    return [*filter(None, sentences), *list_reasons(ground, found)]


def describe_ground(found: Mapping[str, Any] | None) -> str:
    """How many materials and things were found, and what share of the ground is left out."""
    if found is None:
        return ""
    shares = sorted((material["share"] for material in found["materials"]), reverse=True)
    kinds = f"{len(shares)} kinds of ground ({', '.join(f'{share:.0%}' for share in shares)})"
    things = len(found["objects"])
    text = "Found one kind of ground" if len(shares) == 1 else f"Found {kinds}"
    text += f" and {things} {'thing' if things == 1 else 'things'} standing on it" if things else ""
    left_out = found["excluded"]
    return f"{text}." + (f" {left_out:.0%} of it is shown nowhere (dark in materials.png)." if left_out >= 0.01 else "")


def describe_photos(ground: SceneFrame) -> str:
    """How many photos found their place, and the names of those that did not."""
    left_out = [photo.name for photo in ground.left_out]
    if ground.kind != "photos" or not left_out:
        return ""
    more = f" and {len(left_out) - 3} more" if len(left_out) > 3 else ""
    return f"{ground.registered} of {ground.images} photos are used; not {', '.join(left_out[:3])}{more}."


def describe_sharpness(metrics: Path | None) -> str:
    """How photos that were set aside look beside the field; that it is unknown where none was."""
    if metrics is None:
        return ""
    values = read_json(metrics)
    psnr = values.get("psnr_colour_corrected", values.get("psnr"))
    if not isinstance(psnr, int | float) or not math.isfinite(psnr):
        return "No photo was set aside, so how true it is was not measured (--test 2 sets two aside)."
    word = next((word for least, word in SHARPNESS if psnr >= least), WORST)
    return f"Beside {len(values.get('test_views', []))} photos that it never saw, it {word} ({psnr:.1f} dB)."


def list_reasons(ground: SceneFrame, found: Mapping[str, Any] | None) -> list[str]:
    """What is doubtful, the worst first, and what would help."""
    reasons = [sign.reason for sign in ground.verdict.objections] if ground.verdict else []
    verdicts = [material["verdict"] for material in found["materials"]] if found else []
    reasons += [verdict["reason"] for verdict in verdicts if verdict["grade"] != "good"]
    return [f"{reason[:1].upper()}{reason[1:]}." for reason in reasons[:MOST_REASONS]]
