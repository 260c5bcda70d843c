"""The shot list as a web page without scripts or network access, to be opened from a file on a phone."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float32
from markupsafe import Markup
from numpy import ndarray as Array

from dav_gswt.capture import directions, shot_list_map
from dav_gswt.capture.directions import Ruler
from dav_gswt.field import GaussianField
from dav_gswt.geometry.cameras import Camera
from dav_gswt.geometry.scene_frame import SceneFrame
from dav_gswt.images import image_files
from dav_gswt.raster import render
from dav_gswt.templates import render_template

LONGER = 720  # pixels of an expected picture's longer side
ZENITH, HORIZON = np.array([0.42, 0.6, 0.85]), np.array([0.85, 0.9, 0.95])
GROUND = np.array([0.5, 0.5, 0.5])  # where the ground is not known
CLOSE, TURNED = 0.2, 15  # flying heights, degrees: a photo nearer than this to its pose is always assigned to it


@dataclass(frozen=True)
class Station:
    """A place to take photos at. photos: how many are missing."""

    name: str
    camera: Camera
    photos: int


@dataclass(frozen=True)
class ShotList:
    """Header of a shot list. drop: folder for the photos. length: of the walk, in world units."""

    scene: str
    frame: SceneFrame
    ruler: Ruler
    drop: Path
    length: float


@dataclass(frozen=True)
class Card:
    """A station as the page shows it. picture: file of the expected picture, if any."""

    number: int
    walk: str
    pose: str
    photos: int
    picture: str | None
    width: int
    height: int
    facts: dict[str, str]


def write_page(
    folder: Path, template: Path | str, shot_list: ShotList, stations: list[Station], field: GaussianField | None
) -> None:
    """Write index.html, map.png and, if there is a field, the expected picture of every station."""
    by = shot_list.ruler
    drawn = shot_list_map.draw_map([station.camera for station in stations], shot_list.frame, by, field)
    image_files.write_png(folder / "map.png", drawn.picture)
    cards = []
    for i, station in enumerate(stations):
        picture = None
        if field is not None:
            picture = f"place_{i + 1:03d}.png"
            image_files.write_png(folder / picture, render_expected(field, station.camera))
        before = stations[i - 1].camera if i else None
        cards.append(_make_card(i + 1, station, before, shot_list, picture))
    values = {
        "scene": shot_list.scene,
        "summary": _format_summary(sum(station.photos for station in stations), len(stations), shot_list),
        "metric": by.metres is not None,
        "pictured": field is not None,
        "near": f"{by.format_length(CLOSE * by.unit)} and {TURNED} degrees",
        "drop": shot_list.drop,
        "width": drawn.camera.width,
        "height": drawn.camera.height,
        "drawing": Markup(drawn.drawing),
        "cards": cards,
    }
    (folder / "index.html").write_text(render_template(template, values), encoding="utf-8")


def render_expected(field: GaussianField, camera: Camera) -> Float32[Array, "h w 3"]:
    """Render the field over a sky and a ground of its mean colour."""
    scale = LONGER / max(camera.width, camera.height)
    view = camera.resized(max(round(camera.width * scale), 16), max(round(camera.height * scale), 16))
    seen = render(field, view)
    return np.clip(seen.colour + (1 - seen.alpha)[..., None] * _backdrop(view, field), 0, 1)


def _backdrop(camera: Camera, field: GaussianField) -> Float32[Array, "h w 3"]:
    step = camera.rays()[1]
    rise = (step[..., 2] / np.linalg.norm(step, axis=-1))[..., None]
    sky = HORIZON + (ZENITH - HORIZON) * np.clip(rise, 0, 1) ** 0.5
    ground = field.base_colours[field.ground]
    below = np.clip(ground.mean(0), 0, 1) if len(ground) else GROUND
    return np.where(rise > 0, sky, below).astype(np.float32)


def _format_count(many: int, of: str) -> str:
    return f"{many} {of}" if many == 1 else f"{many} {of}s"


def _format_summary(photos: int, places: int, shot_list: ShotList) -> str:
    by, length = shot_list.ruler, shot_list.length
    walk = by.format_length(length) + (f" ({by.format_heights(length)})" if by.metres is not None else "")
    counts = f"{_format_count(photos, 'photo')} from {_format_count(places, 'place')}"
    return f"{counts}; the walk from the first to the last is {walk}."


def _make_card(number: int, station: Station, before: Camera | None, shot_list: ShotList, picture: str | None) -> Card:
    camera, by = station.camera, shot_list.ruler
    out = camera.centre - shot_list.frame.exemplar.centre
    facts = {
        "Height above the ground": by.format_length(float(out[2])),
        "Distance to the middle": by.format_length(float(np.linalg.norm(out[:2]))),
        "Tilt": directions.describe_tilt(camera),
        "Picture": _describe_shape(camera),
    }
    if by.place:
        ahead = directions.heading(camera)
        facts["Compass"] = f"{by.place.azimuth(ahead):.0f} degrees ({by.format_direction(ahead)})"
    facts["Name"] = station.name
    walk = f"From place {number - 1}: {directions.describe_walk(before, camera, by)}." if before else "Start here."
    pose = directions.describe_pose(camera, shot_list.frame, by)
    return Card(number, walk, pose, station.photos, picture, camera.width, camera.height, facts)


def _describe_shape(camera: Camera) -> str:
    if camera.width == camera.height:
        return "square, or its middle"
    return "landscape (wider than high)" if camera.width > camera.height else "portrait (higher than wide)"
