"""The agent `handheld`: writes a shot list for a person, whose photos come through the drop folder.

The shot list is a web page without scripts or network access, to be opened from a file on a phone: a map, and the
places in a short walking order with the picture expected at each.
"""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float, Float32
from numpy import ndarray as Array

from dav_gswt.capture import drop_folder, route
from dav_gswt.capture.store import RequestedPose, Site
from dav_gswt.errors import InputError
from dav_gswt.field import GaussianField, read_field
from dav_gswt.files import atomic_folder
from dav_gswt.geometry import cameras
from dav_gswt.geometry.cameras import Camera
from dav_gswt.geometry.georeference import Georeference
from dav_gswt.geometry.scene_frame import SceneFrame
from dav_gswt.geometry.sun import name_direction
from dav_gswt.images import image_files
from dav_gswt.images.figures import render_template
from dav_gswt.raster import render

LONGER = 720  # pixels of an expected picture's longer side
WIDE = 800  # pixels of the map's longer side; its drawing is readable at half the size
MARGIN = 0.14  # around everything on the map, as a share of the longer side
LOW = 0.5  # flying heights: anything higher would hide the ground on the map
BLANK = 0.8  # grey where nothing is known
CLOSE, TURNED = 0.2, 15  # flying heights, degrees: a photo nearer than this to its pose is always assigned to it
ON_MAP = ("top", "upper right", "right", "lower right", "bottom", "lower left", "left", "upper left")
HERE = 0.05  # flying heights: shorter walks are not mentioned
STEEP = 80.0  # degrees below the horizon from which a camera counts as looking straight down
FACING = 15.0  # degrees: largest angle past the middle that still counts as facing it


@dataclass(frozen=True)
class Ruler:
    """Formats lengths and directions of a scene."""

    frame: SceneFrame

    @property
    def unit(self) -> float:
        """The flying height in world units."""
        return self.frame.flying_height

    @property
    def place(self) -> Georeference | None:
        return self.frame.georeference

    @property
    def metres(self) -> float | None:
        """Metres per world unit, if they are known."""
        return self.place.metres_per_unit if self.place else 1.0 if self.frame.unit == "metre" else None

    def format_length(self, length: float) -> str:
        """A length in world units as metres, or as flying heights if metres are not known."""
        if self.metres is None:
            count = f"{length / self.unit:.1f}"
            return f"{count} flying height{'' if count == '1.0' else 's'}"
        metres = length * self.metres
        return f"{metres:.0f} m" if metres >= 20 else f"{metres:.1f} m"

    def format_direction(self, direction: Float[Array, "d"]) -> str:
        """A compass direction, or a direction on the map if north is not known."""
        if self.place:
            return name_direction(self.place.azimuth(direction))
        return f"the {ON_MAP[round(np.degrees(np.arctan2(direction[0], direction[1])) / 45) % 8]} of the map"


def take_photos(site: Site, requested: list[RequestedPose]) -> None:
    """Import dropped photos; for those still missing write a shot list.

    The map and the expected pictures are of the site's field, if it has one.

    Raises: InputError: photos are missing (the message says which, and names the page to follow).
    """
    missing = drop_folder.import_dropped_photos(site, requested, "handheld")
    if not missing:
        return
    page = write_shot_list(site, missing, read_field(site.field) if site.field else None)
    raise InputError(
        f"{page}: take this page with you, printed or its folder copied to a phone: "
        + drop_folder.describe_missing(site, missing)
    )


def write_shot_list(site: Site, missing: list[RequestedPose], field: GaussianField | None) -> Path:
    """Write captures/{scene}/shot-list/: index.html, map.png and, with a field, a picture of each place.

    Returns: the page.
    """
    by, ground = Ruler(site.frame), np.array([camera.centre[:2] for _, camera in missing])
    ordered = route.order_stops(ground)
    places = [missing[i] for i in ordered]
    view = place_map_camera([camera for _, camera in places], site.frame)
    folder = site.store.folder / "shot-list"
    with atomic_folder(folder) as part:
        blank = np.full((view.height, view.width, 3), BLANK, np.float32)
        image_files.write_png(part / "map.png", blank if field is None else _draw(field, view))
        cards = []
        for i, (pose, camera) in enumerate(places):
            card = _describe_place(camera, places[i - 1][1] if i else None, i, view, by)
            card |= {"name": pose.name, "picture": None}
            if field is not None:
                card["picture"] = f"place_{i + 1:03d}.png"
                scale = LONGER / max(camera.width, camera.height)
                size = (max(round(side * scale), 16) for side in (camera.width, camera.height))
                image_files.write_png(part / card["picture"], _draw(field, camera.resized(*size)))
            cards.append(card)
        walk = by.format_length(route.path_length(ground[list(ordered)]))
        values = {
            "scene": site.name,
            "summary": f"Places: {len(places)}. The walk from the first to the last is {walk}.",
            "metric": by.metres is not None,
            "near": f"{by.format_length(CLOSE * by.unit)} and {TURNED} degrees",
            "drop": drop_folder.make_drop_folder(site),
            "map": _describe_map(view, by),
            "cards": cards,
        }
        (part / "index.html").write_text(render_template(site.shot_list_template, values), encoding="utf-8")
    return folder / "index.html"


def place_map_camera(stations: list[Camera], frame: SceneFrame) -> Camera:
    """A camera that looks down on the exemplar and all stations."""
    square = frame.exemplar
    corners = [[square.west, square.south], [square.east, square.north]]
    points = np.array([*corners, *(station.centre[:2] for station in stations)])
    low, high = points.min(0), points.max(0)
    margin = MARGIN * (high - low).max()
    low, size = low - margin, high - low + 2 * margin
    cell = float(size.max()) / WIDE
    width, height = (max(round(s / cell), WIDE // 2) for s in size)
    west, south = low + (size - cell * np.array([width, height])) / 2
    return cameras.top_down(float(west), float(south), width, height, cell, LOW * frame.flying_height)


def _draw(field: GaussianField, camera: Camera) -> Float32[Array, "h w 3"]:
    return np.clip(render(field, camera, BLANK).colour, 0, 1)


def _describe_map(view: Camera, by: Ruler) -> dict[str, Any]:
    """Where the template draws the exemplar, its middle, a scale and north."""
    square = by.frame.exemplar
    corner, middle = view.project(np.array([[square.west, square.north, 0.0], square.centre]))[0].tolist()
    unit, name = (by.unit, "flying heights") if by.metres is None else (1 / by.metres, "m")
    fifth = view.width / view.fx / unit / 5
    power = 10.0 ** np.floor(np.log10(fifth))
    many = float(max(step * power for step in (1, 2, 5, 10) if step * power <= fifth * 1.001))
    return {
        "width": view.width,
        "height": view.height,
        "corner": corner,
        "middle": middle,
        "side": square.side * view.fx,
        "scale": many * unit * view.fx,
        "scale_text": f"{many:g} {name}",
        "north": by.place.north if by.place else None,
    }


def _describe_place(camera: Camera, before: Camera | None, i: int, view: Camera, by: Ruler) -> dict[str, Any]:
    """A place as the page shows it; turn: of its arrow on the map, degrees; None: the camera looks straight down."""
    steep = abs(tilt(camera)) >= STEEP
    return {
        "number": i + 1,
        "at": view.project(camera.centre[None])[0][0].tolist(),
        "turn": None if steep else float(np.degrees(np.arctan2(-camera.forward[1], camera.forward[0]))),
        "walk": "Start here." if before is None else f"From place {i}: {describe_walk(before, camera, by)}.",
        "pose": describe_pose(camera, by),
        "width": camera.width,
        "height": camera.height,
    }


def tilt(camera: Camera) -> float:
    """Angle of the viewing direction below the horizon, degrees."""
    return float(-np.degrees(np.arcsin(np.clip(camera.forward[2], -1, 1))))


def describe_tilt(camera: Camera) -> str:
    """Say how far down or up a camera looks."""
    down = round(tilt(camera))
    if down >= STEEP:
        return "straight down" if down >= 89 else f"down {down} degrees, nearly straight down"
    return "level" if down == 0 else f"{'down' if down > 0 else 'up'} {abs(down)} degrees"


def describe_facing(camera: Camera, by: Ruler) -> str:
    """Say which way to face, or where the picture's top is if the camera looks down."""
    if abs(tilt(camera)) >= STEEP:
        return f"turn the top of the picture to {by.format_direction(-camera.rotation[1][:2])}"
    ahead, inwards = camera.forward[:2], (by.frame.exemplar.centre - camera.centre)[:2]
    towards = by.format_direction(ahead)
    across = ahead[0] * inwards[1] - ahead[1] * inwards[0]
    off = np.degrees(np.arctan2(abs(across), ahead @ inwards))
    if off > FACING or np.linalg.norm(inwards) < HERE * by.unit:
        return f"face {towards}"
    return f"face the middle, which is to {'the ' if by.place else ''}{towards}"


def describe_pose(camera: Camera, by: Ruler) -> str:
    """Say where to stand, how high to hold the camera, and where it looks."""
    out = (camera.centre - by.frame.exemplar.centre)[:2]
    away, direction = float(np.linalg.norm(out)), by.format_direction(out)
    if away < HERE * by.unit:
        position = "Stand in the middle"
    elif by.place:
        position = f"Stand {by.format_length(away)} {direction} of the middle"
    else:
        position = f"Stand {by.format_length(away)} from the middle, towards {direction}"
    up = f"camera {by.format_length(float(camera.centre[2]))} above the ground"
    return f"{position}, {up}; {describe_facing(camera, by)}; look {describe_tilt(camera)}."


def describe_walk(a: Camera, b: Camera, by: Ruler) -> str:
    """Say how to walk from one pose to the next."""
    way = (b.centre - a.centre)[:2]
    far = float(np.linalg.norm(way))
    if far < HERE * by.unit:
        return "stay where you are"
    return f"go {by.format_length(far)} towards {by.format_direction(way)}"
