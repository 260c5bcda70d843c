"""Which ground a set of photos misses: seen by too few photos, from one side only, or too coarsely.

Footprints are those of the photos on the surface that their points describe, hills and trenches included. The result
is a map, an outline for each gap, and the poses of photos that would fill it.
"""

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from jaxtyping import Bool, Float, Int
from numpy import ndarray as Array
from scipy import ndimage
from scipy.interpolate import griddata
from skimage.measure import find_contours

from dav_gswt.geometry.cameras import Camera, look_at
from dav_gswt.geometry.georeference import Georeference
from dav_gswt.geometry.scene_frame import SceneFrame
from dav_gswt.images import figures
from dav_gswt.photos.colmap_model import ColmapModel
from dav_gswt.photos.ground_frame import find_visible_points
from dav_gswt.photos.view_split import find_aim_point, measure_picture_share

FINE, MOST = 40, 400  # cells in a flying height, and along the longer side of the map at most
NEED = 3  # photos that must see a place
SIDES = 16  # horizontal directions in which views of a place are compared
LEAST_ANGLE = 8.0  # degrees between the outer directions from which a place is seen: less says little of heights
LEAN = 20.0  # degrees off straight down: where all views lean farther to one side, they are from that side only
COARSE = 2.0  # times the usual width of a photo's pixel on the ground
REACH = 4.0  # flying heights from the camera, beyond which a photo tells nothing of the ground
BRIDGE = 1.0  # flying heights: half the width of a bay of the flight plan that is asked for
LEAST_AREA = 0.01  # of a photo's usual footprint: smaller gaps are none
OVERLAP = 0.7  # of neighbouring photos that fill a gap
HORIZON = 0.5  # share of a picture that must show ground within REACH
REASONS = ("seen by no photo", "seen by too few photos", "seen from one side only", "seen too coarsely")
COLOURS = ("#882255", "#d55e00", "#e69f00", "#56b4e9")
WELL, BEYOND = -1, -2  # in place of a reason: seen well, not asked for
GOOD, BACK = "#b8d8b8", "#ffffff"
DOWN = 5.0  # degrees off straight down, within which a camera has no arrow
CAMERA_HEIGHT = "No GPS fits the photos: lengths are in camera heights, the cameras' usual height over the ground."
LABELLED, LISTED = 20, 10  # gaps that have their number on the map, that are told of one by one


@dataclass(frozen=True)
class Surface:
    """Heights of the ground at the centres of square cells; rows from the south, columns from the west."""

    west: float
    south: float
    cell: float
    heights: Float[Array, "rows columns"]

    @cached_property
    def centres(self) -> Float[Array, "n 3"]:
        rows, columns = self.heights.shape
        x = self.west + (np.arange(columns) + 0.5) * self.cell
        y = self.south + (np.arange(rows) + 0.5) * self.cell
        return np.stack([*np.meshgrid(x, y), self.heights], -1).reshape(-1, 3)

    def find_heights(self, places: Float[Array, "n d"]) -> Float[Array, "n"]:
        """Heights below or above places, linear between the centres of cells and constant beyond the outermost."""
        at = (places[:, 1::-1] - [self.south, self.west]) / self.cell - 0.5
        return ndimage.map_coordinates(self.heights, at.T, order=1, mode="nearest")


@dataclass(frozen=True)
class CellViews:
    """How photos see each cell: their number; the side of the finest pixel on the ground, along its longer side; and
    lean: along each of SIDES horizontal directions the least component of the unit vectors to the photos, 1 if none."""

    counts: Int[Array, "rows columns"]
    widths: Float[Array, "rows columns"]
    lean: Float[Array, "sides rows columns"]

    @property
    def angles(self) -> Float[Array, "rows columns"]:
        """Degrees between the outer directions from which each cell is seen, by their distance along the ground."""
        opposite = np.roll(self.lean, SIDES // 2, axis=0)
        apart = np.where(self.counts > 0, -(self.lean + opposite).min(0), 0)
        return 2 * np.degrees(np.arcsin(np.clip(apart / 2, 0, 1)))

    @property
    def one_sided(self) -> Bool[Array, "rows columns"]:
        """Where all views are from nearly one direction, or lean to one side by more than LEAN."""
        return (self.angles < LEAST_ANGLE) | (self.lean.max(0) > np.sin(np.radians(LEAN)))


@dataclass(frozen=True)
class Gap:
    """A connected piece of ground that photos miss.

    areas: in square world units, by reason. rings: closed, in the world's plane, the outer one first and
    counterclockwise, then those around ground that is seen well.
    """

    areas: dict[str, float]
    rings: tuple[Float[Array, "_ 2"], ...]
    middle: Float[Array, "3"]

    @property
    def area(self) -> float:
        return sum(self.areas.values())

    @property
    def reason(self) -> str:
        """What is wrong with most of it."""
        return max(self.areas, key=lambda reason: self.areas[reason])


@dataclass(frozen=True)
class Gaps:
    """What a photo set misses. fault: of each cell its place in REASONS, or WELL or BEYOND.

    area: of all ground that is asked for. pixel: usual side of a photo's pixel on the ground, world units. horizon:
    names of photos that show the horizon more than the ground.
    """

    surface: Surface
    fault: Int[Array, "rows columns"]
    gaps: tuple[Gap, ...]
    area: float
    pixel: float
    horizon: tuple[str, ...]


def find_gaps(model: ColmapModel, frame: SceneFrame, blurred: Collection[str] = ()) -> Gaps:
    """The gaps of a photo set over its ground. model: in the frame's world. blurred: photos that do not count."""
    reach = REACH * frame.flying_height
    pairs = [*zip(model.names, model.cameras, strict=True)]
    horizon = tuple(name for name, camera in pairs if _shows_horizon(camera, reach))
    cameras = [camera for name, camera in pairs if name not in {*blurred, *horizon}]
    surface = build_surface(model, frame, cameras or [*model.cameras])
    views = measure_cells(cameras, surface, reach)
    seen = views.counts >= NEED
    inner = find_inner_ground(cameras, surface, frame.flying_height)
    asked = inner | ndimage.binary_fill_holes(inner | seen) & ~seen
    judged = inner & seen if (inner & seen).any() else seen
    pixel = float(np.median(views.widths[judged])) if seen.any() else np.inf
    faults = [views.counts == 0, ~seen, inner & views.one_sided, inner & (views.widths > COARSE * pixel)]
    fault = np.select([asked & each for each in faults], range(len(faults)), np.where(asked | seen, WELL, BEYOND))
    footprint = np.median([camera.width * camera.height for camera in model.cameras]) * pixel**2
    pieces, _ = ndimage.label(fault >= 0)
    small = np.bincount(pieces.ravel()) * surface.cell**2 < (LEAST_AREA * footprint if seen.any() else 0.0)
    fault = np.where(small[pieces] & (fault >= 0), WELL, fault)
    return Gaps(
        surface, fault, list_gaps(fault, surface), float((fault != BEYOND).sum() * surface.cell**2), pixel, horizon
    )


def _shows_horizon(camera: Camera, reach: float) -> bool:
    """Whether a picture shows more of the horizon than of the ground nearer than `reach`."""
    x, y, _ = camera.centre.tolist()
    return measure_picture_share(camera, (x - reach, y - reach, x + reach, y + reach)) < HORIZON


def build_surface(model: ColmapModel, frame: SceneFrame, cameras: Sequence[Camera]) -> Surface:
    """The surface through the median heights of the points in each cell; it is linear between them.

    It reaches a flying height beyond the places that the cameras look at.
    """
    aims = np.stack([find_aim_point(camera) for camera in cameras])
    low, high = aims.min(0) - frame.flying_height, aims.max(0) + frame.flying_height
    cell = max(frame.flying_height / FINE, float((high - low).max() / MOST))
    columns, rows = np.ceil((high - low) / cell).astype(int)
    at = np.floor((model.points[:, :2] - low) / cell).astype(int)
    inside = ((at >= 0) & (at < [columns, rows])).all(1)
    flat = at[inside, 1] * columns + at[inside, 0]
    cells = np.unique(flat)
    heights = np.asarray(ndimage.median(model.points[inside, 2], flat, cells), float)
    known = np.stack(np.divmod(cells, columns), -1)
    grid = np.mgrid[:rows, :columns].reshape(2, -1).T
    filled = np.full(len(grid), np.nan)
    if len(np.unique(known[:, 0])) > 1 and len(np.unique(known[:, 1])) > 1 and len(known) > 3:
        filled = griddata(known, heights, grid, "linear")
    nearest = griddata(known, heights, grid, "nearest") if len(known) else np.zeros(len(grid))
    filled = np.where(np.isfinite(filled), filled, nearest).reshape(rows, columns)
    return Surface(float(low[0]), float(low[1]), cell, ndimage.median_filter(filled, 3))


def measure_cells(cameras: Sequence[Camera], surface: Surface, reach: float) -> CellViews:
    """How cameras see the cells of a surface. reach: photos from farther away do not count."""
    points, shape = surface.centres, surface.heights.shape
    turns = 2 * np.pi * np.arange(SIDES) / SIDES
    sides = np.stack([np.cos(turns), np.sin(turns)])
    counts, finest, lean = np.zeros(len(points), int), np.full(len(points), np.inf), np.ones((SIDES, len(points)))
    for camera in cameras:
        sees = find_seen_cells(camera, surface, reach)
        way = camera.centre - points[sees]
        way /= np.linalg.norm(way, axis=1, keepdims=True)
        depth = (points[sees] - camera.centre) @ camera.forward
        counts[sees] += 1
        finest[sees] = np.minimum(finest[sees], depth / camera.fx / np.clip(way[:, 2], 0.05, 1))
        lean[:, sees] = np.minimum(lean[:, sees], (way[:, :2] @ sides).T)
    return CellViews(counts.reshape(shape), finest.reshape(shape), lean.reshape(SIDES, *shape))


def find_seen_cells(camera: Camera, surface: Surface, reach: float) -> Int[Array, "k"]:
    """Indices of the cells that a camera sees: in the picture, nearer than `reach`, and not hidden by higher ground.

    The line from a cell to the camera is followed in steps of a cell until it is above all ground. Ground hides what
    lies behind it if it rises above the line by more than half a cell, since heights are not exact.
    """
    points = surface.centres
    rows = np.flatnonzero(find_visible_points(camera, points, reach))
    start, way = points[rows], camera.centre - points[rows]
    level = np.maximum(np.linalg.norm(way[:, :2], axis=1), 1e-9)
    with np.errstate(divide="ignore", invalid="ignore"):
        top = np.where(way[:, 2] > 0, (surface.heights.max() - start[:, 2]) / way[:, 2], 1.0)
    steps = np.clip(top, 0, 1) * level / surface.cell
    hidden = np.zeros(len(rows), bool)
    for step in range(1, int(steps.max(initial=0)) + 1):
        there = np.flatnonzero(~hidden & (step <= steps))
        on_line = start[there] + (step * surface.cell / level[there])[:, None] * way[there]
        hidden[there] = surface.find_heights(on_line) > on_line[:, 2] + 0.5 * surface.cell
    return rows[~hidden]


def find_inner_ground(cameras: Sequence[Camera], surface: Surface, height: float) -> Bool[Array, "rows columns"]:
    """The ground between the places that photos look at: what a flight was meant to show.

    Its margin, which the outermost photos show from one side or once, is not asked for. Bays narrower than two BRIDGE
    are closed, and holes.
    """
    rows, columns = surface.heights.shape
    aimed, steps = np.zeros((rows, columns), bool), round(BRIDGE * height / surface.cell)
    for camera in cameras:
        column, row = np.floor((find_aim_point(camera) - [surface.west, surface.south]) / surface.cell).astype(int)
        aimed[row, column] = True
    away = ndimage.distance_transform_edt(~np.pad(aimed, steps + 1))
    closed = ndimage.distance_transform_edt(away <= steps) > steps
    return ndimage.binary_fill_holes(closed[steps + 1 : -steps - 1, steps + 1 : -steps - 1] | aimed)


def list_gaps(fault: Int[Array, "rows columns"], surface: Surface) -> tuple[Gap, ...]:
    """The connected pieces of cells with faults, the largest first."""
    found, (pieces, _) = [], ndimage.label(fault >= 0)
    corner = np.array([surface.west, surface.south])
    for piece, box in enumerate(ndimage.find_objects(pieces), 1):
        own = pieces[box] == piece
        counts = np.bincount(fault[box][own], minlength=len(REASONS)) * surface.cell**2
        start = corner + surface.cell * np.array([box[1].start, box[0].start])
        outlines = find_contours(np.pad(own, 1).astype(float), 0.5, positive_orientation="low")
        rings = [start + surface.cell * (line[:, ::-1] - 0.5) for line in outlines]
        rings.sort(key=lambda ring: -np.ptp(ring, axis=0).max())  # the outer one first
        deep = np.unravel_index(ndimage.distance_transform_edt(np.pad(own, 1))[1:-1, 1:-1].argmax(), own.shape)
        middle = start + surface.cell * (np.array(deep[::-1]) + 0.5)
        areas = {reason: float(area) for reason, area in zip(REASONS, counts, strict=True) if area}
        found.append(Gap(areas, tuple(rings), np.r_[middle, surface.find_heights(middle[None])]))
    return tuple(sorted(found, key=lambda gap: -gap.area))


def plan_photos(gaps: Gaps, frame: SceneFrame, lens: Camera) -> list[Camera]:
    """Photos straight down that fill the gaps: NEED more of every cell, from the usual flying height above the highest
    ground below. lens: whose view they have.

    They are chosen greedily among the knots of a grid whose neighbours overlap by OVERLAP.
    """
    surface, height = gaps.surface, frame.flying_height
    missed = np.flatnonzero(gaps.fault >= 0)
    if not len(missed):
        return []
    size = height * np.array([lens.width / lens.fx, lens.height / lens.fy])
    step, at = (1 - OVERLAP) * size, surface.centres[missed, :2]
    low, high = np.floor((at.min(0) - size / 2) / step), np.ceil((at.max(0) + size / 2) / step)
    knots = np.stack(np.meshgrid(*(np.arange(a, b + 1) for a, b in zip(low, high, strict=True))), -1).reshape(-1, 2)
    window = np.maximum(1, np.round(size[::-1] / surface.cell).astype(int))
    highest = replace(surface, heights=ndimage.maximum_filter(surface.heights, tuple(window)))
    cameras = []
    for knot, ground in zip(knots * step, highest.find_heights(knots * step), strict=True):
        rotation, translation = look_at([*knot, ground + height], [*knot, ground])
        cameras.append(replace(lens, rotation=rotation, translation=translation))
    sees = np.stack([np.isin(missed, find_seen_cells(camera, surface, REACH * height)) for camera in cameras])
    chosen, left = [], np.full(len(missed), NEED)
    while True:
        gain = np.count_nonzero(sees & (left > 0), axis=1)
        gain[chosen] = 0
        if not gain.any():
            return [cameras[i] for i in sorted(chosen)]
        chosen.append(int(gain.argmax()))
        left = left - sees[chosen[-1]]


def describe_gaps(gaps: Gaps, frame: SceneFrame) -> dict[str, Any]:
    """The gaps as GeoJSON, in longitude and latitude where the photos have GPS, else in the world's units."""

    def locate(ring: Float[Array, "n 2"]) -> list[list[float]]:
        if frame.georeference is None:
            return np.round(ring, 6).tolist()
        earth = frame.georeference.to_earth(np.c_[ring, gaps.surface.find_heights(ring)])
        return np.round(earth[:, [1, 0]], 8).tolist()

    unit = "m2" if frame.unit == "metre" else "square flying heights"
    features = [
        {
            "type": "Feature",
            "properties": {
                "number": number,
                "reason": gap.reason,
                "area": round(gap.area, 4),
                "areas": {reason: round(area, 4) for reason, area in gap.areas.items()},
                "unit": unit,
            },
            "geometry": {"type": "Polygon", "coordinates": [locate(ring) for ring in gap.rings]},
        }
        for number, gap in enumerate(gaps.gaps, 1)
    ]
    return {"type": "FeatureCollection", "features": features}


def describe_ground(found: Gaps, frame: SceneFrame) -> list[str]:
    """What ground is missing, in words: a line in all, and one for each of the largest gaps."""
    whole = f"{format_area(found.area, frame)} of ground"
    if not found.gaps:
        return [f"No gaps: three photos or more see all {whole}, from several sides and closely enough."]
    missing = sum(gap.area for gap in found.gaps)
    lines = [f"{format_area(missing, frame)} of {whole} is missing ({100 * missing / found.area:.1f} %):"]
    for number, gap in enumerate(found.gaps[:LISTED], 1):
        parts = sorted(gap.areas.items(), key=lambda part: -part[1])
        words = ", ".join(f"{format_area(area, frame)} {reason}" for reason, area in parts)
        lines.append(f"  {number}. {words}{_format_place(gap.middle, frame)}")
    if (more := len(found.gaps) - LISTED) > 0:
        lines.append(f"  and {more} smaller {'one' if more == 1 else 'ones'}")
    return lines


def format_area(area: float, frame: SceneFrame) -> str:
    """An area of square world units in words: hectares from one on."""
    if frame.unit != "metre":
        return f"{area:.2f} square camera heights"
    return f"{area / 1e4:.2f} ha" if area >= 1e4 else f"{area:.0f} m²" if area >= 10 else f"{area:.1f} m²"


def _format_place(at: Float[Array, "3"], frame: SceneFrame) -> str:
    if frame.georeference is None:
        return f", at {at[0]:.2f}, {at[1]:.2f} of the map"
    latitude, longitude, _ = frame.georeference.to_earth(at[None])[0]
    return f", at {latitude:.6f}, {longitude:.6f}"


def draw_gaps(
    gaps: Gaps, model: ColmapModel, frame: SceneFrame, unused: Collection[str] = (), tests: Collection[str] = ()
):
    """The map: ground by what is wrong with it, the exemplar, and where the photos were taken and look.

    unused: photos that do not count. tests: that only test.
    """
    from matplotlib.colors import BoundaryNorm, ListedColormap  # not above: it loads for a second
    from matplotlib.patches import Rectangle

    surface, unit = gaps.surface, "m" if frame.unit == "metre" else "camera heights"
    rows, columns = surface.heights.shape
    here, x, y = gaps.fault != BEYOND, surface.centres[:columns, 0], surface.centres[::columns, 1]
    places = np.array([camera.centre[:2] for camera in model.cameras])
    shown = np.concatenate([places, np.stack([x[here.nonzero()[1]], y[here.nonzero()[0]]], 1)])
    low, high = shown.min(0) - 0.1 * frame.flying_height, shown.max(0) + 0.1 * frame.flying_height
    figure = figures.make_figure(8.0, float(np.clip(7 * (high - low)[1] / (high - low)[0], 3, 10)) + 1.2)
    axes = figure.subplots()
    east, north = surface.west + columns * surface.cell, surface.south + rows * surface.cell
    colours = ListedColormap([BACK, GOOD, *COLOURS])
    axes.imshow(
        gaps.fault,
        cmap=colours,
        norm=BoundaryNorm(np.arange(BEYOND - 0.5, len(COLOURS) + 0.5), colours.N),
        origin="lower",
        extent=(surface.west, east, surface.south, north),
        interpolation="nearest",
    )
    axes.contour(x, y, np.where(here, surface.heights, np.nan), 8, colors="k", alpha=0.2, linewidths=0.5)
    square = frame.exemplar
    axes.add_patch(Rectangle((square.west, square.south), square.side, square.side, fill=False, ls="--", lw=1.5))
    marks = [axes.plot([], [], "s", color=colour, ms=9)[0] for colour in (GOOD, *COLOURS)]
    names = ["seen well", *REASONS]
    used = {*model.names} - {*unused, *tests}
    for name, mark, face, photos in (
        ("photos", ".", "k", used),
        ("photos that do not count", "x", "k", unused),
        ("test photos", "o", "w", tests),
    ):
        at = places[[photo in photos for photo in model.names]]
        if len(at):
            marks += axes.plot(at[:, 0], at[:, 1], color="k", ls="", ms=4, marker=mark, mfc=face)
            names.append(name)
    for camera in model.cameras:
        _draw_direction(axes, camera, frame.flying_height)
    for number, gap in enumerate(gaps.gaps[:LABELLED], 1):
        outline = {"boxstyle": "circle,pad=0.25", "fc": "w", "ec": "k", "lw": 0.8}
        axes.text(gap.middle[0], gap.middle[1], str(number), ha="center", va="center", fontsize=8, bbox=outline)
    figure.legend(marks, names, loc="outside lower center", ncols=4, fontsize=8, frameon=False)
    if frame.georeference:
        _draw_north(axes, frame.georeference)
    axes.set(xlabel=f"x, {unit}", ylabel=f"y, {unit}", aspect="equal")
    axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]))
    return figure


def _draw_direction(axes, camera: Camera, unit: float) -> None:
    """An arrow of at most half a flying height to where the middle of a picture looks; none if that is down."""
    start, ahead = camera.centre[:2], find_aim_point(camera) - camera.centre[:2]
    if camera.forward[2] > -0.1:  # it looks to the horizon
        ahead = unit * camera.forward[:2]
    if -camera.forward[2] < np.cos(np.radians(DOWN)):
        ahead = ahead * min(1.0, 0.5 * unit / max(float(np.linalg.norm(ahead)), 1e-12))
        axes.annotate("", start + ahead, start, arrowprops={"arrowstyle": "->", "shrinkA": 0})


def _draw_north(axes, place: Georeference) -> None:
    """An arrow to the north in the corner of a map."""
    turn = np.radians(place.north)
    tip = np.array([0.93, 0.93]) + 0.07 * np.array([-np.sin(turn), np.cos(turn)])
    arrow = {"arrowstyle": "<-"}
    axes.annotate("N", (0.93, 0.93), tuple(tip), "axes fraction", "axes fraction", arrow, ha="center", va="center")
