"""What was made, in a few sentences: what was found, how good it will look and why, and what would help."""

import math
from collections.abc import Mapping
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np

from dav_gswt.files import read_json
from dav_gswt.geometry.scene_frame import SceneFrame, read_scene_frame
from dav_gswt.materials.left_out import describe_left_out
from dav_gswt.tiles.periods import describe_rows

# PSNR of test photos, after their exposure is fitted, from which a grade holds
GRADES = ((30.0, "very good"), (25.0, "good"), (20.0, "fair: softer than they are"))
POOR = "poor: its details differ from theirs"
APART = 3.0  # dB below the median: something is wrong with this test photo
ENOUGH_PHOTOS = 20
AGAIN = "Photograph the ground again, sharply, with one camera and zoom, while nothing moves"


def judge_terrain(
    frame: Path,
    materials: Path | None,
    metrics: Path | None,
    windows: Path | None = None,
    manifest: Path | None = None,
    seams: Path | None = None,
) -> list[str]:
    """Sentences on a finished terrain.

    frame: ground.json. materials: materials.json. metrics: of the last round. windows: windows.json. manifest:
    davgswt.json. seams: seams.json. Raises: InputError: a file is not readable.
    """
    ground = read_scene_frame(frame)
    found, fitted, bundle, cut = (read_json(path) if path else None for path in (materials, windows, manifest, seams))
    said = [*describe_ground(found), *describe_photos(ground), *describe_quality(ground, metrics)]
    return said + describe_sharpness(ground, fitted, bundle) + describe_patterns(ground, cut) + list_scarce(found)


def describe_patterns(frame: SceneFrame, cut: Mapping[str, Any] | None) -> list[str]:
    """The rows of regular ground, material by material."""
    said, (unit, scale) = [], measure_unit(frame)
    for tiles in (cut, *cut.get("materials", [])) if cut else ():
        if pattern := tiles["seams"].get("pattern"):
            rows = describe_rows(np.array(pattern["waves"]), scale * tiles["spacing"], f" {unit}")
            said.append(f"The ground has rows {rows}: tiles are whole numbers of them.")
    return said


def measure_unit(frame: SceneFrame) -> tuple[str, float]:
    """What lengths are said in, and how many of it a unit of the scene is."""
    unit = "m" if frame.unit == "metre" else "units of the splat" if frame.source else "camera heights"
    return unit, frame.source.unit if frame.source else 1.0


def describe_sharpness(
    frame: SceneFrame, fitted: Mapping[str, Any] | None, bundle: Mapping[str, Any] | None
) -> list[str]:
    """From how high the ground looks sharp, and how its cells compare with the pixels of the photos."""
    if bundle is None:
        return []
    unit, scale = measure_unit(frame)
    said = f"The ground looks sharp from {scale * bundle['eye_floor']:.2g} {unit} above it"
    if fitted:
        wide = f" ({100 * fitted['cell']:.2g} cm)" if unit == "m" else ""
        said += f": its cells{wide} are {fitted['cell'] / fitted['pixel']:.1f} times as wide as pixels of the photos"
    return [f"{said}."]


def describe_ground(found: Mapping[str, Any] | None) -> list[str]:
    """How many materials and objects were found, what share of the ground is left out, and how to leave more out."""
    if found is None:
        return []
    shares = sorted((material["share"] for material in found["materials"]), reverse=True)
    kinds = f"{len(shares)} kinds of ground ({', '.join(f'{share:.0%}' for share in shares)})"
    said, left_out = ["Found one kind of ground." if len(shares) == 1 else f"Found {kinds}."], found["excluded"]
    if left_out >= 0.01:
        said[0] += f" {left_out:.0%} of it is not in the terrain (dark in materials.png)."
    if phrases := describe_left_out(found["left_out"]):
        said.append(f"Left out: {', '.join(phrases)}.")
    if things := len(found["objects"]):
        count, which = ("1 thing on it is", "it") if things == 1 else (f"{things} things on it are", "some")
        mask = f"to leave {which} out: `materials: {{exclude: MASK.png}}` in scene.yaml, see docs/photos.md"
        said.append(f"{count} scattered over the terrain ({mask}).")
    return said


def describe_photos(ground: SceneFrame) -> list[str]:
    """How many photos found their place, and the names of those that did not."""
    left_out = [photo.name for photo in ground.left_out]
    if ground.kind != "photos" or not left_out:
        return []
    more = f" and {len(left_out) - 3} more" if len(left_out) > 3 else ""
    return [f"{ground.registered} of {ground.images} photos are used; not {', '.join(left_out[:3])}{more}."]


def describe_quality(ground: SceneFrame, metrics: Path | None) -> list[str]:
    """How test photos look beside the field; for a poor score the likely cause and what to do."""
    doubts = ground.verdict.describe() if ground.verdict and ground.verdict.objections else ""
    values = read_json(metrics) if metrics else {}
    values |= values.get("windows", {})  # what tiles are cut from
    psnr = values.get("psnr_colour_corrected", values.get("psnr"))
    said = ["No photo was set aside, so the quality was not measured (--test 2 sets two aside)."] if metrics else []
    if isinstance(psnr, int | float) and math.isfinite(psnr):
        grade = next((grade for least, grade in GRADES if psnr >= least), POOR)
        tests = "1 test photo" if (count := len(values["test_views"])) == 1 else f"{count} test photos"
        said = [f"Compared with {tests}, the terrain is {grade} ({psnr:.1f} dB PSNR; good from 25, very good from 30)."]
        if grade == POOR:
            return said + explain_poor_quality(values, doubts)
    return said + ([f"The {doubts}."] if doubts else [])


def explain_poor_quality(values: Mapping[str, Any], doubts: str) -> list[str]:
    """The likely cause, where the data tell one, and what to do."""
    scores = {Path(view["view"]).stem: view["psnr_colour_corrected"] for view in values["test_views"]}
    apart = [name for name, score in scores.items() if score < median(scores.values()) - APART]
    if doubts:
        cause, advice = doubts, AGAIN
    elif apart:
        cause, advice = f"other things or light in {', '.join(apart)}", "Leave out photos in which things moved"
    elif values["photos"] < ENOUGH_PHOTOS:
        cause, advice = f"only {values['photos']} photos", f"Take {ENOUGH_PHOTOS} or more that overlap by two thirds"
    else:
        cause, advice = "unknown, often blur or things that moved", f"Leave such photos out. {AGAIN} if that is no help"
    return [f"The likely cause: {cause}.", f"{advice}."]


def list_scarce(found: Mapping[str, Any] | None) -> list[str]:
    """The kinds of ground of which too little was photographed for tiles that do not repeat."""
    kinds, said = found["materials"] if found else [], []
    for kind in kinds:
        which = f"The kind that covers {kind['share']:.0%}" if len(kinds) > 1 else "The ground"
        if kind["verdict"]["grade"] != "good":
            what_to_do = kind["verdict"]["reason"].rpartition(": ")[2]
            said.append(f"{which} was photographed on a small area: {what_to_do}.")
    return said
