"""The report on a scene's photos: which were used, which were not and why, and what to photograph
next.

The page is one HTML file that loads nothing. The same photos/ folder and template give the same
bytes.
"""

import base64
import io
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from dav_gswt.files import atomic_file
from dav_gswt.geometry.scene_frame import SceneFrame, read_scene_frame
from dav_gswt.images import figures, image_files
from dav_gswt.logs import progress
from dav_gswt.photos import gaps
from dav_gswt.photos.colmap_model import ColmapModel, read_colmap_model, reprojection_errors
from dav_gswt.photos.sharpness import find_blurred
from dav_gswt.templates import render_template

LEAST_SIDE = 0.5  # flying heights: side of an exemplar with room for tiles that differ
THUMBNAIL = 200  # pixels of the longer side
MASKED = np.array([0.85, 0.1, 0.5], np.float32)


@dataclass(frozen=True)
class ReportFacts:
    """A scene's photos.

    tests: names of those that only test. error: mean reprojection error in pixels; None where it is unknown.
    """

    frame: SceneFrame
    model: ColmapModel
    tests: frozenset[str]
    error: float | None


def write_report(folder: Path | str, template: Path | str, scene: str, out: Path | str) -> None:
    """Write the report on a photos/ folder (images/, sparse/, ground.json) to `out`.

    Raises: InputError: the folder is not readable, or the template uses a name that has no value.
    """
    found = collect_facts(folder)
    frame, names = found.frame, sorted(found.model.names, key=lambda name: name in found.tests)
    pictures = {name: make_thumbnail(Path(folder) / "images" / name) for name in progress(names, "shrink photos")}
    missed, blurred = find_missed_ground(found, Path(folder) / "images")
    values = {
        "scene": scene,
        "summary": _summarize(found),
        "advice": list_advice(found),
        "gaps": gaps.describe_ground(missed, frame) if missed else None,
        "gaps_map": draw_map(found, missed, blurred) if missed else None,
        "blurred": blurred,
        "horizon": missed.horizon if missed else (),
        "facts": _list_facts(found),
        "verdict": frame.verdict,
        "left_out": frame.left_out,
        "photos": pictures,
        "tests": found.tests,
    }
    with atomic_file(out) as part:
        part.write_text(render_template(template, values), encoding="utf-8")


def collect_facts(folder: Path | str) -> ReportFacts:
    """The facts of a photos/ folder. Raises: InputError: what it holds is not readable."""
    folder = Path(folder)
    frame, model = read_scene_frame(folder / "ground.json"), read_colmap_model(folder / "sparse")
    tests, off = frozenset(frame.test or ()), reprojection_errors(model)
    error = float(off.mean()) if frame.reprojection_error is None and len(off) else frame.reprojection_error
    return ReportFacts(frame, model, tests, error)


def find_missed_ground(found: ReportFacts, images: Path) -> tuple[gaps.Gaps | None, list[str]]:
    """The ground that all placed photos miss, None where no points are known; and the names of blurred photos."""
    names = found.model.names
    blurred = find_blurred([images / name for name in names], threads=1)
    blurred = [name for name, is_blurred in zip(names, blurred.tolist(), strict=True) if is_blurred]
    return gaps.find_gaps(found.model, found.frame, blurred) if len(found.model.points) else None, blurred


def _summarize(found: ReportFacts) -> str:
    frame, side = found.frame, f"{found.frame.exemplar.side:.2f} {found.frame.unit}s"
    if frame.kind == "synthetic":
        tests, photos = len(found.tests), len(found.model.names)
        first = f"{photos - tests} photos were rendered, and {tests} for testing; their cameras are exact."
    else:
        first = f"{frame.registered} of {frame.images} photos were placed."
    return f"{first} Tiles are cut from a square of ground that is {side} wide, the exemplar (dashed on the map)."


def list_advice(found: ReportFacts) -> list[str]:
    """What is weak about the set, and what to do about it."""
    frame, said = found.frame, []
    if frame.verdict and frame.verdict.grade != "good":
        reasons = "; ".join(sign.reason for sign in frame.verdict.objections)
        said.append(f"The cameras are {frame.verdict.grade}: {reasons}.")
    if frame.left_out:
        said.append(
            f"{len(frame.left_out)} of {frame.images} photos were left out for the reasons below. Photos taken between "
            "them and the others can help."
        )
    side = frame.exemplar.side / frame.flying_height
    if side < LEAST_SIDE:
        said.append(
            f"The exemplar is only {side:.2f} flying heights wide, so tiles repeat soon. Photograph more ground."
        )
    return said


def _list_facts(found: ReportFacts) -> list[tuple[str, str]]:
    """Numbers that help to judge the set: names and values."""
    frame, facts = found.frame, []
    if found.error is not None:
        facts.append(("Reprojection error", f"{found.error:.2f} px (good: below 1)"))
    if frame.focal:
        ratio = f"{frame.focal_ratio:.3f} times EXIF's; " if frame.focal_ratio else ""
        facts.append(("Focal length", ratio + frame.focal.decision))
    if frame.georeference:
        facts.append(("Place", f"{frame.georeference.latitude:.6f}, {frame.georeference.longitude:.6f}"))
    return facts


def draw_map(found: ReportFacts, missed: gaps.Gaps, blurred: list[str]) -> str:
    """The map of the ground and of the cameras, as a data URI."""
    unused = {*blurred, *missed.horizon} - found.tests
    figure, file = gaps.draw_gaps(missed, found.model, found.frame, unused, found.tests), io.BytesIO()
    figure.savefig(file, format="png", metadata={"Software": None})
    return _encode_uri(file.getvalue(), "png")


def make_thumbnail(path: Path) -> str:
    """A small picture as a data URI, what is masked in pink."""
    image, cover = image_files.read_photo_and_alpha(path)
    small, counts = (image_files.shrink_to(part, THUMBNAIL) for part in (image, cover[..., None]))
    return _encode_uri(figures.encode_jpeg(counts * small + (1 - counts) * (0.5 * small + 0.5 * MASKED), 80), "jpeg")


def _encode_uri(data: bytes, kind: str) -> str:
    return f"data:image/{kind};base64,{base64.b64encode(data).decode('ascii')}"
