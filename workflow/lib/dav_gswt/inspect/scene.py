"""A scene as plain arrays: layers, labels, and the meaning of the colours."""

from dataclasses import dataclass, field, replace

import numpy as np
from jaxtyping import Float, Float32, Int, UInt8
from numpy import ndarray as Array

UNCERTAINTY_MAP = "coolwarm"  # blue: certain, red: uncertain
UNKNOWN = (150, 150, 150)  # the colour of what is NaN
BLACK = (25, 25, 25)
MAP_ENTRIES = 4096  # entries of a colour map: more steps than eight bits tell apart


@dataclass(frozen=True)
class Layer:
    """Geometry of one kind.

    Attributes:
        kind: faces (rows of `cells` are corners), lines (rows are both ends), points (no cells), or picture (cells is
            one quad, its corners from the top left clockwise).
        colours: of each cell, of each point where there are no cells, or one for all.
        width: of a line or a point, in pixels.
        picture: rows from the top.
    """

    kind: str
    points: Float32[Array, "n 3"]
    cells: Int[Array, "m k"] | None = None
    colours: UInt8[Array, "m 3"] | tuple[int, int, int] = BLACK
    width: float = 2.0
    picture: UInt8[Array, "h w 3"] | None = None


@dataclass(frozen=True)
class Label:
    """Text in the scene, `height` world units tall, centred at a place. upright: facing the first view; else it lies on
    the ground."""

    text: str
    place: tuple[float, float, float]
    height: float
    upright: bool = True


@dataclass(frozen=True)
class ColourBar:
    """Colours that stand for numbers, from `low` to `high`."""

    title: str
    low: float
    high: float
    colours: str = UNCERTAINTY_MAP


@dataclass(frozen=True)
class ColourKey:
    """Colours that stand for names."""

    named: dict[str, tuple[int, int, int]]


@dataclass(frozen=True)
class Scene:
    """Content of a window, picture or page.

    Attributes:
        title: one line. notes: lines below it.
        low, high: the box that the first view shows whole.
        viewer: direction from the box to the viewer in the first view.
        flat: pictures side by side, seen straight on.
    """

    title: str
    layers: list[Layer]
    low: Float[Array, "3"]
    high: Float[Array, "3"]
    notes: list[str] = field(default_factory=list)
    labels: list[Label] = field(default_factory=list)
    legend: list[ColourBar | ColourKey] = field(default_factory=list)
    viewer: tuple[float, float, float] = (-0.45, -1.0, 0.75)
    flat: bool = False


def to_bytes(colours: Float[Array, "*n 3"]) -> UInt8[Array, "*n 3"]:
    """Colours in [0, 1] as bytes; beyond they are clipped."""
    return np.rint(np.clip(colours, 0, 1) * 255).astype(np.uint8)


def map_colours(values: Float[Array, "*n"], bar: ColourBar) -> UInt8[Array, "*n 3"]:
    """The bar's colours of values; UNKNOWN where they are NaN."""
    from matplotlib import colormaps

    known = np.isfinite(values)
    span = bar.high - bar.low
    share = (np.where(known, values, bar.low) - bar.low) / (span if span > 0 else 1.0)
    table = to_bytes(colormaps[bar.colours].resampled(MAP_ENTRIES)(np.arange(MAP_ENTRIES))[:, :3])
    colours = table[np.rint(np.clip(share, 0, 1) * (MAP_ENTRIES - 1)).astype(int)]
    colours[~known] = UNKNOWN
    return colours


def make_bar(title: str, values: Float[Array, "*n"], colours: str = UNCERTAINTY_MAP, most: float = 1.0) -> ColourBar:
    """A bar from the least value to the quantile `most`; one unit wide if the values are constant or none is finite."""
    known = values[np.isfinite(values)]
    low, high = (float(known.min()), float(np.quantile(known, most))) if known.size else (0.0, 1.0)
    return ColourBar(title, low, high if high > low else low + 1.0, colours)


def move_layer(layer: Layer, by: Float[Array, "3"]) -> Layer:
    """The layer, translated."""
    return replace(layer, points=(layer.points + by).astype(np.float32))


def make_outline(west: float, south: float, east: float, north: float, z: float, colour: tuple[int, int, int]) -> Layer:
    """A level rectangle's border."""
    corners = np.array([[west, south, z], [east, south, z], [east, north, z], [west, north, z]], np.float32)
    return Layer("lines", corners, np.array([[0, 1], [1, 2], [2, 3], [3, 0]]), colour, 3.0)


def make_balls(centres: Float[Array, "n 3"], radius: float, colours: UInt8[Array, "n 3"]) -> Layer:
    """A ball at each place."""
    from trimesh.creation import icosphere

    shape = icosphere(subdivisions=2, radius=radius)
    return copy_shape(np.asarray(shape.vertices)[None] + centres[:, None], np.asarray(shape.faces), colours)


def copy_shape(points: Float[Array, "n v 3"], faces: Int[Array, "f k"], colours: UInt8[Array, "n 3"]) -> Layer:
    """One shape many times over: its corners in each copy, its faces, a colour a copy."""
    n, v = points.shape[:2]
    cells = (faces[None] + v * np.arange(n)[:, None, None]).reshape(-1, faces.shape[1])
    return Layer("faces", points.reshape(-1, 3).astype(np.float32), cells, np.repeat(colours, len(faces), 0))


def make_picture(
    picture: UInt8[Array, "h w 3"], corner: Float[Array, "3"], right: Float[Array, "3"], down: Float[Array, "3"]
) -> Layer:
    """A picture on a parallelogram, from its top left corner along its upper and its left border."""
    points = np.array([corner, corner + right, corner + right + down, corner + down])
    return Layer("picture", points.astype(np.float32), np.array([[0, 1, 2, 3]]), picture=picture)
