"""The map of a shot list: the ground from above with the places, their order and viewing directions as SVG."""

from dataclasses import dataclass
from html import escape

import numpy as np
from jaxtyping import Float, Float32
from numpy import ndarray as Array

from dav_gswt.capture import directions
from dav_gswt.capture.directions import Ruler
from dav_gswt.field import GaussianField
from dav_gswt.geometry import cameras
from dav_gswt.geometry.cameras import Camera
from dav_gswt.geometry.scene_frame import SceneFrame
from dav_gswt.raster import render

WIDE = 800  # pixels of the longer side; the overlay is readable at half the size
MARGIN = 0.14  # around everything, as a share of the longer side
LOW = 0.5  # flying heights: anything higher would hide the ground
BLANK = 0.8  # grey where nothing is known
DOT, ARROW = 23.0, 54.0  # pixels: radius of a number's disc, length of an arrow from its middle
ITERATIONS = 60  # of spreading discs apart
STEPS = (1, 2, 5, 10)


@dataclass(frozen=True)
class Map:
    """A map. drawing: SVG over the picture."""

    camera: Camera
    picture: Float32[Array, "h w 3"]
    drawing: str


def draw_map(stations: list[Camera], frame: SceneFrame, by: Ruler, field: GaussianField | None) -> Map:
    """Draw the map of poses in walking order, with the exemplar, a scale, and north if it is known."""
    camera = _map_camera(stations, frame, by)
    blank = np.full((camera.height, camera.width, 3), BLANK, np.float32)
    picture = blank if field is None else np.clip(render(field, camera, BLANK).colour, 0, 1)
    at = camera.project(np.array([station.centre for station in stations]))[0]
    shown = spread_apart(at, 2.1 * DOT)
    parts = [_draw_exemplar(camera, frame), _draw_path(at), _draw_scale(camera, by)]
    parts += [
        _draw_station(i + 1, place, label, station)
        for i, (place, label, station) in enumerate(zip(at, shown, stations, strict=True))
    ]
    if by.place:
        parts.append(_draw_north(camera, by.place.north))
    return Map(camera, picture, "\n".join(parts))


def _map_camera(stations: list[Camera], frame: SceneFrame, by: Ruler) -> Camera:
    square = frame.exemplar
    corners = [[square.west, square.south], [square.east, square.north]]
    points = np.array([*corners, *(station.centre[:2] for station in stations)])
    low, high = points.min(0), points.max(0)
    margin = MARGIN * (high - low).max()
    low, size = low - margin, high - low + 2 * margin
    cell = float(size.max()) / WIDE
    width, height = (max(round(s / cell), WIDE // 2) for s in size)
    west, south = low + (size - cell * np.array([width, height])) / 2
    return cameras.top_down(float(west), float(south), width, height, cell, LOW * by.unit)


def spread_apart(at: Float[Array, "n 2"], least: float) -> Float[Array, "n 2"]:
    """Move points until they are at least `least` apart, or nearly so if there are many."""
    moved = at + 1e-3 * np.stack([np.cos(np.arange(len(at))), np.sin(np.arange(len(at)))], 1)  # none in one place
    for _ in range(ITERATIONS):
        gap = moved[:, None] - moved[None]
        far = np.linalg.norm(gap, axis=-1)
        push = np.where((far < least) & (far > 0), (least - far) / 2, 0.0) / np.maximum(far, 1e-9)
        moved = moved + (push[..., None] * gap).sum(1)
    return moved


def _draw_exemplar(camera: Camera, frame: SceneFrame) -> str:
    square = frame.exemplar
    west, north = square.west, square.north
    middle = [west + square.side / 2, north - square.side / 2, 0.0]
    (x, y), (u, v) = camera.project(np.array([[west, north, 0.0], middle]))[0]
    side = square.side * camera.fx
    return (
        f'<rect class="wanted" x="{x:.1f}" y="{y:.1f}" width="{side:.1f}" height="{side:.1f}"/>'
        f'<path class="cross" d="M{u - 12:.1f} {v:.1f}h24M{u:.1f} {v - 12:.1f}v24"/>'
    )


def _draw_path(at: Float[Array, "n 2"]) -> str:
    points = " ".join(f"{x:.1f},{y:.1f}" for x, y in at)
    return f'<polyline class="halo" points="{points}"/><polyline class="way" points="{points}"/>'


def _draw_station(number: int, at: Float[Array, "2"], shown: Float[Array, "2"], station: Camera) -> str:
    """Draw a disc with the number, an arrow in the viewing direction, and a line to the place."""
    x, y = shown
    thread = f'<path class="thread" d="M{at[0]:.1f} {at[1]:.1f}L{x:.1f} {y:.1f}"/>'
    arrow = ""
    if abs(directions.tilt(station)) < directions.STEEP:
        turn = np.degrees(np.arctan2(-station.forward[1], station.forward[0]))
        shape = f"M{DOT - 2} -9L{ARROW - 18} -9v-9L{ARROW} 0L{ARROW - 18} 18v-9L{DOT - 2} 9z"
        arrow = f'<path class="arrow" transform="translate({x:.1f} {y:.1f}) rotate({turn:.1f})" d="{shape}"/>'
    disc = f'<circle class="disc" cx="{x:.1f}" cy="{y:.1f}" r="{DOT}"/>'
    text = f'<text class="number" x="{x:.1f}" y="{y + 9:.1f}">{number}</text>'
    return f'<a href="#place-{number}" aria-label="Place {number}">{thread}{arrow}{disc}{text}</a>'


def _draw_scale(camera: Camera, by: Ruler) -> str:
    """Draw a bar of a round length near a fifth of the map."""
    unit = by.unit if by.metres is None else 1 / by.metres
    name = "flying height" if by.metres is None else "m"
    fifth = camera.width / camera.fx / unit / 5
    power = 10.0 ** np.floor(np.log10(fifth))
    many = max(step * power for step in STEPS if step * power <= fifth * 1.001)
    plural = "s" if by.metres is None and many != 1 else ""
    x, y, long = 24, camera.height - 28, many * unit * camera.fx
    bar = f"M{x} {y - 8}v8h{long:.1f}v-8"
    text = escape(f"{many:g} {name}{plural}")
    return (
        f'<path class="halo" d="{bar}"/><path class="bar" d="{bar}"/>'
        f'<text class="legend" x="{x}" y="{y - 16}">{text}</text>'
    )


def _draw_north(camera: Camera, north: float) -> str:
    x, y = camera.width - 50, 62
    return (
        f'<g transform="translate({x} {y}) rotate({-north:.1f})"><circle class="disc" r="36"/>'
        '<path class="needle" d="M0 -32L10 0L0 -7L-10 0z"/>'
        f'<text class="number" transform="translate(0 14) rotate({north:.1f})" y="8">N</text></g>'
    )
