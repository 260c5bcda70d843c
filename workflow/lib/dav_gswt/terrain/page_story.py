"""How a page's terrain was made: the photos in small with their places over the ground, the rounds, what tests said.

A page holds story.json and photos.jpg, the photos beside and below each other, and shows both when somebody asks.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float32
from numpy import ndarray as Array

from dav_gswt.files import read_json
from dav_gswt.geometry.scene_frame import read_scene_frame
from dav_gswt.images.figures import encode_jpeg
from dav_gswt.images.image_files import read_photo, shrink_to
from dav_gswt.paths import decode_path
from dav_gswt.photos.capture_record import TakenPhoto, list_taken_photos
from dav_gswt.photos.view_split import read_view_split

STORY, SHEET = "story.json", "photos.jpg"
MOST = 64  # photos that are shown in small, spread over all
THUMB, COLUMNS, QUALITY = 120, 8, 60  # longer side in pixels; of the sheet; of its JPEG


@dataclass(frozen=True)
class Story:
    """value: what story.json holds. sheet: photos.jpg."""

    value: dict[str, Any]
    sheet: bytes


def tell_story(given: Mapping[str, Any]) -> Story | None:
    """The story of a round's field, or None for a finished field, which has no photos.

    Args:   given: `views` (views.json), `images` and `model` of the scene, `frame` (ground.json), `captures` of
            the rounds, `metrics` (metrics.json) of the first fit and of each round, which may be another preset's
            before the last; without `views`: a finished field.
    Raises: InputError: a file is missing or not of its kind.
    """
    if not given.get("views"):
        return None
    taken = list_photos(given)
    shown = np.unique(np.linspace(0, len(taken) - 1, min(len(taken), MOST)).round().astype(int)).tolist()
    frame, photos = read_scene_frame(given["frame"]), []
    for photo in taken:  # where its camera is, seen from the exemplar's centre, and where it looks, on the ground
        at = (photo.camera.centre - frame.exemplar.centre).tolist()
        look = photo.camera.rotation[2, :2].tolist()
        photos.append({"round": photo.round, "at": [round(v, 3) for v in at], "look": [round(v, 3) for v in look]})
    for number, k in enumerate(shown):
        photos[k]["picture"] = number
    presets = [decode_path(Path(path)).get("preset") for path in given["metrics"]]
    rounds = [
        {
            "photos": sum(photo.round == t for photo in taken),
            # fits of another preset cannot be compared: they were measured on smaller photos and other ground
            "psnr": _psnr(path, frame.kind) if preset == presets[-1] else None,
        }
        for t, (path, preset) in enumerate(zip(given["metrics"], presets, strict=True))
    ]
    half = frame.exemplar.side / 2
    value = {
        "unit": frame.unit, "half": half, "photos": photos, "rounds": rounds, "thumb": THUMB, "columns": COLUMNS,
        "pictures": len(shown), "grade": frame.verdict.grade if frame.verdict else None,
    }  # fmt: skip
    smalls = [shrink_to(read_photo(taken[k].source), THUMB) for k in shown]
    return Story(value, encode_jpeg(draw_sheet(smalls), QUALITY))


def list_photos(given: Mapping[str, Any]) -> list[TakenPhoto]:
    """All photos of a round's field in the order they were taken. Raises: as `tell_story`."""
    from dav_gswt.photos.colmap_model import read_colmap_model  # here, not above: it loads pycolmap

    start = read_view_split(given["views"]).start
    return list_taken_photos(given["images"], read_colmap_model(given["model"]), start, given["captures"])


def draw_sheet(smalls: Sequence[Float32[Array, "_ _ 3"]]) -> Float32[Array, "height width 3"]:
    """Small photos, each in the middle of a square of THUMB pixels, COLUMNS in a row."""
    rows = max(1, -(-len(smalls) // COLUMNS))
    sheet = np.zeros((rows * THUMB, COLUMNS * THUMB, 3), np.float32)
    for k, small in enumerate(smalls):
        height, width = small.shape[:2]
        top, left = k // COLUMNS * THUMB + (THUMB - height) // 2, k % COLUMNS * THUMB + (THUMB - width) // 2
        sheet[top : top + height, left : left + width] = small
    return sheet


def _psnr(path: Path | str, kind: str) -> float | None:
    """PSNR of the test photos in metrics.json, in the windows if there are any, of real photos after their exposure is
    fitted; None: none was spared."""
    values = read_json(path)
    value = values.get("windows", values).get("psnr_colour_corrected" if kind == "photos" else "psnr")
    return round(value, 2) if isinstance(value, int | float) and np.isfinite(value) else None
