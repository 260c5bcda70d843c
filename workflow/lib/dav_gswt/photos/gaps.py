"""Which ground a set of photos misses: seen by too few photos, from one side only, or too coarsely.

Footprints are those of the photos on the surface that their points describe, hills and trenches included. The result
is a map, an outline for each gap, and the poses of photos that would fill it.
"""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from jaxtyping import Bool, Float, Int
from matplotlib.figure import Figure
from numpy import ndarray as Array
from scipy import ndimage
from scipy.interpolate import griddata
from skimage.measure import find_contours

from dav_gswt.geometry.cameras import Camera, look_at
from dav_gswt.geometry.scene_frame import SceneFrame
from dav_gswt.photos.colmap_model import ColmapModel

CELLS = 200  # along the longer side of the map
DEPTH_SIDE = 96  # pixels along the longer side of the pictures in which hidden ground is found
HIDDEN = 0.04  # of the distance: ground farther behind what a photo shows there is hidden in it
NEED = 3  # photos that must see a place
LEAST_ANGLE = 8.0  # degrees between the outer directions from which a place is seen
COARSE = 2.0  # times the usual width of a photo's pixel on the ground
REACH = 4.0  # flying heights from the camera, beyond which a photo tells nothing of the ground
LEAST_AREA = 0.01  # of a picture's footprint: smaller gaps are none
OVERLAP = 0.7  # of neighbouring photos that fill a gap
HORIZON = 75.0  # degrees off straight down, from which a picture shows the horizon
REASONS = ("seen by no photo", "seen by too few photos", "seen from one side", "seen too coarsely")
COLOURS = ("#882255", "#d55e00", "#e69f00", "#56b4e9")
GOOD = "#b8d8b8"


@dataclass(frozen=True)
class Surface:
    """Heights of the ground at the centres of square cells; rows from the south, columns from the west."""

    west: float
    south: float
    cell: float
    heights: Float[Array, "rows columns"]

    @property
    def centres(self) -> Float[Array, "n 3"]:
        rows, columns = self.heights.shape
        x = self.west + (np.arange(columns) + 0.5) * self.cell
        y = self.south + (np.arange(rows) + 0.5) * self.cell
        return np.stack([*np.meshgrid(x, y), self.heights], -1).reshape(-1, 3)


@dataclass(frozen=True)
class Gap:
    """A piece of ground that photos miss. reason: its place in REASONS. outline: closed, in the world's plane."""

    reason: int
    area: float
    outline: Float[Array, "n 2"]


@dataclass(frozen=True)
class Gaps:
    """What a photo set misses. fault: of each cell its place in REASONS, -1 where it is seen well, -2 outside.

    area: of all ground that is asked for. pixel: usual width of a photo's pixel on the ground, world units. horizon:
    names of photos that look at the horizon.
    """

    surface: Surface
    fault: Int[Array, "rows columns"]
    gaps: tuple[Gap, ...]
    area: float
    pixel: float
    horizon: tuple[str, ...]


def find_gaps(model: ColmapModel, frame: SceneFrame) -> Gaps:
    """The gaps of a photo set over its ground. model: in the frame's world."""
    surface = build_surface(model, frame)
    counts, angles, widths = measure_cells(model.cameras, surface, REACH * frame.flying_height)
    asked = find_asked_ground(counts, frame.flying_height / surface.cell)
    pixel = float(np.median(widths[counts >= NEED])) if (counts >= NEED).any() else np.inf
    faults = [counts == 0, counts < NEED, angles < LEAST_ANGLE, widths > COARSE * pixel]
    fault = np.select([asked & each for each in faults], range(len(faults)), np.where(asked, -1, -2))
    footprint = (pixel * np.mean([camera.width for camera in model.cameras])) ** 2
    gaps = list_gaps(fault, surface, LEAST_AREA * footprint)
    tilted = np.cos(np.radians(HORIZON))
    pairs = zip(model.names, model.cameras, strict=True)
    horizon = tuple(name for name, camera in pairs if -camera.forward[2] < tilted)
    return Gaps(surface, fault, gaps, float(asked.sum() * surface.cell**2), pixel, horizon)


def build_surface(model: ColmapModel, frame: SceneFrame) -> Surface:
    """The surface through the median heights of the points in each cell; gaps between them are interpolated."""
    low, high = np.percentile(model.points[:, :2], [1, 99], axis=0)
    low, high = low - 0.5 * frame.flying_height, high + 0.5 * frame.flying_height
    cell = float((high - low).max() / CELLS)
    columns, rows = np.maximum(1, np.ceil((high - low) / cell).astype(int))
    at = np.floor((model.points[:, :2] - low) / cell).astype(int)
    inside = ((at >= 0) & (at < [columns, rows])).all(1)
    flat = at[inside, 1] * columns + at[inside, 0]
    cells = np.unique(flat)
    heights = ndimage.median(model.points[inside, 2], flat, cells)
    known = np.stack(np.divmod(cells, columns), -1)
    grid = np.mgrid[:rows, :columns].reshape(2, -1).T
    filled = griddata(known, heights, grid, "linear") if len(known) > 3 else np.full(len(grid), np.nan)
    nearest = griddata(known, heights, grid, "nearest")
    filled = np.where(np.isfinite(filled), filled, nearest).reshape(rows, columns)
    return Surface(float(low[0]), float(low[1]), cell, ndimage.median_filter(filled, 3))


def measure_cells(
    cameras: tuple[Camera, ...], surface: Surface, reach: float
) -> tuple[Int[Array, "rows columns"], Float[Array, "rows columns"], Float[Array, "rows columns"]]:
    """Of each cell: photos that see it, degrees between the directions to the outer ones, width of the finest pixel.

    The angle is twice the largest one off the mean direction. reach: farther photos do not count.
    """
    points = surface.centres
    counts, total = np.zeros(len(points), int), np.zeros((len(points), 3))
    finest = np.full(len(points), np.inf)
    seen = []
    for camera in cameras:
        sees = find_seen_points(camera, points, reach)
        away = camera.centre - points[sees]
        distance = np.linalg.norm(away, axis=1)
        counts[sees] += 1
        total[sees] += away / distance[:, None]
        depth = (points[sees] - camera.centre) @ camera.forward
        finest[sees] = np.minimum(finest[sees], depth / camera.fx)
        seen.append(sees)
    mean = total / np.maximum(np.linalg.norm(total, axis=1, keepdims=True), 1e-12)
    least = np.ones(len(points))
    for camera, sees in zip(cameras, seen, strict=True):
        away = camera.centre - points[sees]
        cosine = np.einsum("ni,ni->n", away, mean[sees]) / np.linalg.norm(away, axis=1)
        least[sees] = np.minimum(least[sees], cosine)
    angles = 2 * np.degrees(np.arccos(np.clip(least, -1, 1)))
    shape = surface.heights.shape
    return counts.reshape(shape), angles.reshape(shape), finest.reshape(shape)


def find_seen_points(camera: Camera, points: Float[Array, "n 3"], reach: float) -> Int[Array, "k"]:
    """Indices of the points of a surface that a camera sees: inside the picture, near, and behind no others."""
    at, depth = camera.project(points)
    inside = (depth > 0) & (depth < reach) & (at > 0).all(1) & (at < [camera.width, camera.height]).all(1)
    rows = np.flatnonzero(inside)
    scale = DEPTH_SIDE / max(camera.width, camera.height)
    pixel = np.floor(at[rows] * scale).astype(int)
    flat = pixel[:, 1] * (DEPTH_SIDE + 1) + pixel[:, 0]
    nearest = np.full((DEPTH_SIDE + 1) ** 2, np.inf)
    np.minimum.at(nearest, flat, depth[rows])
    return rows[depth[rows] <= nearest[flat] + HIDDEN * np.linalg.norm(points[rows] - camera.centre, axis=1)]


def find_asked_ground(counts: Int[Array, "rows columns"], reach: float) -> Bool[Array, "rows columns"]:
    """The ground that the photos were meant to show: what enough of them see, with holes and bays closed.

    reach: half the width of a bay that is closed, in cells.
    """
    well, steps = counts >= NEED, max(1, round(0.5 * reach))
    padded = np.pad(well, steps)
    away = ndimage.distance_transform_edt(~padded)
    closed = ndimage.distance_transform_edt(away <= steps) > steps
    return ndimage.binary_fill_holes(closed[steps:-steps, steps:-steps] | well)


def list_gaps(fault: Int[Array, "rows columns"], surface: Surface, least: float) -> tuple[Gap, ...]:
    """The connected pieces of cells of one fault, the largest first; pieces smaller than `least` are left out."""
    found = []
    for reason in range(len(REASONS)):
        pieces, count = ndimage.label(fault == reason)
        for piece in range(1, count + 1):
            area = float((pieces == piece).sum() * surface.cell**2)
            if area >= least:
                rings = find_contours(np.pad(pieces == piece, 1).astype(float), 0.5)
                ring = max(rings, key=len)  # the outer one
                outline = np.array([surface.west, surface.south]) + surface.cell * (ring[:, ::-1] - 0.5)
                found.append(Gap(reason, area, outline))
    return tuple(sorted(found, key=lambda gap: -gap.area))


def plan_photos(gaps: Gaps, frame: SceneFrame, lens: Camera) -> list[tuple[str, Camera]]:
    """Photos straight down that fill the gaps, from the usual flying height on a grid. lens: whose view they have."""
    height, surface = frame.flying_height, gaps.surface
    step = (1 - OVERLAP) * height * np.array([lens.width / lens.fx, lens.height / lens.fy])
    rows, columns = np.nonzero(gaps.fault >= 0)
    at = surface.cell * (np.stack([columns, rows], 1) + 0.5)
    planned = []
    for square in np.unique(np.floor(at / step).astype(int), axis=0):
        own = (np.floor(at / step).astype(int) == square).all(1)
        ground = float(surface.heights[rows[own], columns[own]].max())
        x, y = (surface.west, surface.south) + at[own].mean(0)
        rotation, translation = look_at([x, y, ground + height], [x, y, ground])
        name = f"gap_{len(planned) + 1:03d}"
        planned.append((name, replace(lens, rotation=rotation, translation=translation)))
    return planned


def describe_gaps(gaps: Gaps, frame: SceneFrame) -> dict[str, Any]:
    """The gaps as GeoJSON, in longitude and latitude where the photos have GPS, else in the world's units."""
    place = frame.georeference

    def locate(outline: Float[Array, "n 2"]) -> list[list[float]]:
        if place is None:
            return outline.tolist()
        earth = place.to_earth(np.c_[outline, np.zeros(len(outline))])
        return np.round(earth[:, [1, 0]], 8).tolist()

    unit = "m2" if frame.unit == "metre" else "square flying heights"
    features = [
        {
            "type": "Feature",
            "properties": {"reason": REASONS[gap.reason], "area": round(gap.area, 4), "unit": unit},
            "geometry": {"type": "Polygon", "coordinates": [locate(gap.outline)]},
        }
        for gap in gaps.gaps
    ]
    return {"type": "FeatureCollection", "features": features}


def draw_gaps(gaps: Gaps, model: ColmapModel, frame: SceneFrame) -> Figure:
    """The map: ground by what is wrong with it, and where the photos were taken."""
    from matplotlib.colors import BoundaryNorm, ListedColormap  # not above: it loads for a second

    surface = gaps.surface
    rows, columns = surface.heights.shape
    figure = Figure(figsize=(8, 8 * max(0.3, rows / columns) + 1.2), layout="constrained")
    axes = figure.subplots()
    east, north = surface.west + columns * surface.cell, surface.south + rows * surface.cell
    colours = ListedColormap(["#ffffff", GOOD, *COLOURS])
    axes.imshow(
        gaps.fault,
        cmap=colours,
        norm=BoundaryNorm(np.arange(-2.5, len(COLOURS) + 0.5), colours.N),
        origin="lower",
        extent=(surface.west, east, surface.south, north),
        interpolation="nearest",
    )
    places = np.array([camera.centre for camera in model.cameras])
    axes.plot(places[:, 0], places[:, 1], "k.", ms=4)
    marks = [axes.plot([], [], "s", color=c, ms=9)[0] for c in (GOOD, *COLOURS)] + [axes.plot([], [], "k.")[0]]
    axes.legend(marks, ["seen well", *REASONS, "photos"], loc="upper center", bbox_to_anchor=(0.5, -0.08), ncols=2)
    unit = "metres" if frame.unit == "metre" else "flying heights"
    axes.set(xlabel=f"east, {unit}" if frame.georeference else unit, ylabel=f"north, {unit}")
    axes.set_aspect("equal")
    return figure
