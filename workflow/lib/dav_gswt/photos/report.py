"""The report on a scene's photos: which were used, which were not and why, and what to photograph
next.

The page is one HTML file that loads nothing. The same photos/ folder and template give the same
bytes.
"""

import base64
import io
from pathlib import Path

import numpy as np

from dav_gswt.files import atomic_file
from dav_gswt.geometry.scene_frame import SceneFrame, read_scene_frame
from dav_gswt.images import figures, image_files
from dav_gswt.images.figures import render_template
from dav_gswt.logs import progress
from dav_gswt.photos import gaps
from dav_gswt.photos.colmap_model import ColmapModel, read_colmap_model, reprojection_errors
from dav_gswt.photos.photo_files import find_blurred
from dav_gswt.photos.sfm.verdict import describe_error

LEAST_SIDE = 0.5  # flying heights: side of an exemplar with room for tiles that differ
THUMBNAIL = 200  # pixels of the longer side
MASKED = np.array([0.85, 0.1, 0.5], np.float32)


def write_report(folder: Path | str, template: Path | str, scene: str, out: Path | str) -> None:
    """Write the report on a photos/ folder (images/, sparse/, ground.json) to `out`.

    Raises: InputError: the folder is not readable, or the template uses a name that has no value.
    """
    images = Path(folder) / "images"
    frame, model = read_scene_frame(Path(folder) / "ground.json"), read_colmap_model(Path(folder) / "sparse")
    tests = frame.test or ()
    names = sorted(model.names, key=lambda name: name in tests)
    pictures = {name: make_thumbnail(images / name) for name in progress(names, "shrink photos")}
    missed, blurred = find_missed_ground(frame, model, images)
    values = {
        "scene": scene,
        "summary": _summarize(frame, model),
        "advice": list_advice(frame),
        "gaps": gaps.describe_ground(missed, frame) if missed else None,
        "gaps_map": draw_map(frame, model, missed, blurred) if missed else None,
        "blurred": blurred,
        "horizon": missed.horizon if missed else (),
        "facts": _list_facts(frame, model),
        "verdict": frame.verdict,
        "left_out": frame.left_out,
        "photos": pictures,
        "tests": tests,
    }
    with atomic_file(out) as part:
        part.write_text(render_template(template, values), encoding="utf-8")


def find_missed_ground(frame: SceneFrame, model: ColmapModel, images: Path) -> tuple[gaps.Gaps | None, list[str]]:
    """The ground that all placed photos miss, None where no points are known; and the names of blurred photos."""
    flags = find_blurred([images / name for name in model.names], threads=1)
    blurred = [name for name, is_blurred in zip(model.names, flags.tolist(), strict=True) if is_blurred]
    return gaps.find_gaps(model, frame, blurred) if len(model.points) else None, blurred


def _summarize(frame: SceneFrame, model: ColmapModel) -> str:
    side = f"{frame.exemplar.side:.2f} {'metres' if frame.unit == 'metre' else 'camera heights'}"
    if frame.kind == "synthetic":
        tests, photos = len(frame.test or ()), len(model.names)
        first = f"{photos - tests} photos were rendered, and {tests} for testing; their cameras are exact."
    else:
        first = f"{frame.registered} of {frame.images} photos were placed."
    said = f"{first} Tiles are cut from a square of ground that is {side} wide (dashed on the map)."
    return said if frame.unit == "metre" else f"{said} {gaps.CAMERA_HEIGHT}"


def list_advice(frame: SceneFrame) -> list[str]:
    """What is weak about the set, and what to do about it."""
    said = []
    if frame.verdict and frame.verdict.grade != "good":
        said.append(f"The {frame.verdict.describe()}.")
    if frame.left_out:
        said.append(
            f"{len(frame.left_out)} of {frame.images} photos were left out for the reasons below. Photos taken between "
            "them and the others can help."
        )
    side = frame.exemplar.side / frame.flying_height
    if side < LEAST_SIDE:
        said.append(f"Tiles repeat soon: their square is {side:.2f} camera heights wide. Photograph more ground.")
    return said


def _list_facts(frame: SceneFrame, model: ColmapModel) -> list[tuple[str, str]]:
    """Numbers that help to judge the set: names and values."""
    facts, error = [], frame.reprojection_error
    if error is None and len(model.pixels):
        error = float(reprojection_errors(model).mean())
    if error is not None:
        facts.append(("Reprojection error", describe_error(error)))
    if frame.focal:
        ratio = f"{frame.focal_ratio:.3f} times EXIF's; " if frame.focal_ratio else ""
        facts.append(("Focal length", ratio + frame.focal.decision))
    if frame.georeference:
        facts.append(("Place", f"{frame.georeference.latitude:.6f}, {frame.georeference.longitude:.6f}"))
    if frame.sun:
        facts.append(("Light", frame.sun.describe()))
    return facts


def draw_map(frame: SceneFrame, model: ColmapModel, missed: gaps.Gaps, blurred: list[str]) -> str:
    """The map of the ground and of the cameras, as a data URI."""
    tests, file = frame.test or (), io.BytesIO()
    figure = gaps.draw_gaps(missed, model, frame, {*blurred, *missed.horizon} - {*tests}, tests)
    figure.savefig(file, format="png", metadata={"Software": None})
    return _encode_uri(file.getvalue(), "png")


def make_thumbnail(path: Path) -> str:
    """A small picture as a data URI, what is masked in pink."""
    image, cover = image_files.read_photo_and_alpha(path)
    small, counts = (image_files.shrink_to(part, THUMBNAIL) for part in (image, cover[..., None]))
    return _encode_uri(figures.encode_jpeg(counts * small + (1 - counts) * (0.5 * small + 0.5 * MASKED), 80), "jpeg")


def _encode_uri(data: bytes, kind: str) -> str:
    return f"data:image/{kind};base64,{base64.b64encode(data).decode('ascii')}"
