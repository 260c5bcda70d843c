"""Which squares of the ground are fitted at the photos' resolution: those that tiles and objects are cut from."""

from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import numpy as np
from jaxtyping import Bool, Float
from numpy import ndarray as Array

from dav_gswt.field import GaussianField, read_field, write_field
from dav_gswt.files import atomic_folder, read_record, write_json
from dav_gswt.geometry.scene_frame import Square
from dav_gswt.images import image_files
from dav_gswt.materials.build import MARGINAL, ROOM, FocusedFields, GroundPlan, find_cells
from dav_gswt.materials.extraction import SKIRT
from dav_gswt.materials.maps import GroundMaps, measure_ground, resample_maps
from dav_gswt.materials.objects import measure_size
from dav_gswt.photos.training_views import TrainingView
from dav_gswt.reconstruction.fitting.plan import FitSettings, limit_discs
from dav_gswt.reconstruction.ground import Ground, read_ground, write_ground
from dav_gswt.reconstruction.top_view import render_top_view
from dav_gswt.reconstruction.windows import FitWindow, measure_pixel_widths
from dav_gswt.tiles.layout import Exemplar
from dav_gswt.tiles.patches import box_sums

NAME = "windows.json"
LAYERS = ("height", "surface", "cover", "known")  # of maps.exr, beside the colours
FittedWindow = tuple[GaussianField, Ground]
KNOTS = 16  # points along the exemplar's side where the width of a pixel is measured
ENOUGH_VIEWS = 3  # photos of a place, of which more make it no better
OWN = 0.5  # of a window that is its material, beyond the least window: what else is in it is fitted for nothing
MOST = 0.8  # of what there is of a material: its window holds so much at most before it grows for variety
AROUND_OBJECT = 2  # cells of the maps beside an object's skirt
SHRUNK = 0.97  # factor of the windows' sides, until they fit into the Gaussians allowed


@dataclass(frozen=True)
class Focus:
    """The windows, and the widths of their cells and of a photo's pixel there, in world units."""

    windows: list[FitWindow]
    spacing: float
    pixel: float


@dataclass(frozen=True)
class WindowsRecord:
    """windows.json. tiled: of each window, whether tiles are cut from it. cell, pixel: widths of a cell, and of a
    photo's pixel where photos show most detail, in world units."""

    tiled: list[bool]
    cell: float
    pixel: float


@dataclass(frozen=True)
class _Box:
    """A square in cells of the maps."""

    row: int
    column: int
    side: int

    @property
    def slices(self) -> tuple[slice, slice]:
        return slice(self.row, self.row + self.side), slice(self.column, self.column + self.side)

    def enclose(self, other: "_Box") -> "_Box":
        """The smallest square about both."""
        row, column = min(self.row, other.row), min(self.column, other.column)
        end = max(self.row + self.side, other.row + other.side), max(self.column + self.side, other.column + other.side)
        return _Box(row, column, max(end[0] - row, end[1] - column))


def choose_windows(plan: GroundPlan, views: Sequence[TrainingView], settings: FitSettings) -> Focus:
    """Choose a square for each material and for each object that lies in none of them.

    A material's window is at least ROOM tiles wide and holds MARGINAL tile areas of it, where there are so many. It
    lies where pixels are finest and ENOUGH_VIEWS photos look. All windows grow alike, while they hold mostly their
    material, as far as the Gaussians suffice for cells of `settings.spacing` pixels; if they do not suffice for the
    least windows, cells are wider.
    """
    place = plan.maps.exemplar
    widths, quality = _measure_quality(plan, views)
    kept = [k for k, own in enumerate(plan.sources) if own.any()]
    least = {k: _find_least_side(plan.sources[k], plan.tile_side) for k in kept}
    things = [_surround(each.cells) for each in plan.classes.footprints]
    cells = limit_discs(settings.max_gaussians)
    most = {k: _find_largest_side(plan.sources[k], side) for k, side in least.items()}
    grown = max(most[k] / least[k] for k in kept)
    while True:
        sides = {k: min(most[k], round(grown * side)) for k, side in least.items()}
        boxes = {k: _place_window(plan.sources[k] * quality, sides[k]) for k in kept}
        windows, tiled = _join_boxes(list(boxes.values()), things)
        area = sum((each.side * place.spacing) ** 2 for each in windows)
        pixel = min(float(np.median(widths[box.slices])) for box in windows[:tiled])
        spacing = max(settings.spacing * pixel, float(np.sqrt(area / cells)))
        if spacing <= settings.spacing * pixel or grown <= 1:
            break
        grown = max(1.0, SHRUNK * grown)
    fitted, cell = [], place.spacing
    for number, box in enumerate(windows):
        square = Square(place.west + box.column * cell, place.south + box.row * cell, box.side * cell)
        fitted.append(FitWindow(square, number < tiled))
    return Focus(fitted, spacing, pixel)


def _measure_quality(
    plan: GroundPlan, views: Sequence[TrainingView]
) -> tuple[Float[Array, "m m"], Float[Array, "m m"]]:
    """Width of a photo's pixel on each cell, and how well the cell is seen, 1 at best; from knots of the exemplar."""
    place, m = plan.maps.exemplar, plan.maps.cells
    step = m / KNOTS
    at = np.minimum(((np.arange(KNOTS) + 0.5) * step).astype(int), m - 1)
    x, y = np.meshgrid(place.west + (at + 0.5) * place.spacing, place.south + (at + 0.5) * place.spacing)
    points = np.stack([x.ravel(), y.ravel(), plan.maps.height[np.ix_(at, at)].ravel()], 1)
    width, count = measure_pixel_widths(points, views)
    width = np.where(count > 0, width, np.nanmax(width))
    seen = np.minimum(count, ENOUGH_VIEWS) / ENOUGH_VIEWS
    index = np.minimum((np.arange(m) / step).astype(int), KNOTS - 1)
    pick, quality = np.ix_(index, index), seen * (width.min() / width) ** 2
    return width.reshape(KNOTS, KNOTS)[pick], quality.reshape(KNOTS, KNOTS)[pick]


def _find_least_side(own: Bool[Array, "m m"], tile_side: float) -> int:
    """Cells of the smallest window that may do for a material."""
    m = len(own)
    wanted = min(MARGINAL * tile_side**2, MOST * own.sum())
    side = min(m, round(ROOM * tile_side))
    while side < m and box_sums(own, side, side).max() < wanted:
        side = min(m, max(side + 1, round(side / SHRUNK)))
    return side


def _find_largest_side(own: Bool[Array, "m m"], least: int) -> int:
    """Cells of the largest window that is OWN of the material, at least the least one."""
    side = len(own)
    while side > least and box_sums(own, side, side).max() < OWN * side**2:
        side = max(least, int(SHRUNK * side))
    return side


def _place_window(values: Float[Array, "m m"], side: int) -> _Box:
    """The square of this side with the largest sum."""
    sums = box_sums(values, side, side)
    row, column = np.unravel_index(int(sums.argmax()), sums.shape)
    return _Box(int(row), int(column), side)


def _surround(cells: Bool[Array, "m m"]) -> _Box:
    """The square about an object with its skirt, within the exemplar."""
    m = len(cells)
    ends = [np.flatnonzero(cells.any(axis))[[0, -1]] for axis in (1, 0)]
    reach = max(3, round(SKIRT * measure_size(cells))) + AROUND_OBJECT
    side = min(m, max(int(np.ptp(end)) + 1 for end in ends) + 2 * reach)
    row, column = (int(np.clip(end.mean() + 0.5 - side / 2, 0, m - side)) for end in ends)
    return _Box(row, column, side)


def _join_boxes(materials: list[_Box], things: list[_Box]) -> tuple[list[_Box], int]:
    """The different windows, and how many of them, the first, are of materials.

    Materials share a window where one about both is no larger than the two. An object has a window of its own where
    none of a material contains it, or shares one with its neighbours.
    """
    windows = _merge_boxes(materials)
    alone = [thing for thing in things if not any(box.enclose(thing) == box for box in windows)]
    return windows + _merge_boxes(alone), len(windows)


def _merge_boxes(boxes: list[_Box]) -> list[_Box]:
    """Boxes of which no two are together as large as the square about both."""
    merged: list[_Box] = []
    for box in boxes:
        while near := [each for each in merged if box.enclose(each).side ** 2 <= box.side**2 + each.side**2]:
            merged.remove(near[0])
            box = box.enclose(near[0])
        merged.append(box)
    return merged


def take_uncertainty(focused: FocusedFields, draft: GaussianField, grid: Ground) -> FocusedFields:
    """The windows with the uncertainty that a draft has there: a prior scores the draft, and tiles use its answer."""
    above = render_top_view(draft, grid).uncertainty.astype(float)
    layer = replace(grid, heights=above)
    windows = [
        (replace(field, uncertainty=layer.height_at(field.means).astype(np.float32)), own)
        for field, own in focused.windows
    ]
    return replace(focused, windows=windows)


def map_windows(maps: GroundMaps, fitted: Sequence[FittedWindow]) -> GroundMaps:
    """Maps of an exemplar with those of its fitted windows in place of the draft's."""
    place = maps.exemplar
    layers = {name: getattr(maps, name).copy() for name in ("colour", *LAYERS)}
    for field, grid in fitted:
        rows, columns = find_cells(place, grid)
        corner = place.west + columns.start * place.spacing, place.south + rows.start * place.spacing
        cells = max(rows.stop - rows.start, columns.stop - columns.start)
        own = resample_maps(measure_ground(field, grid), Exemplar(*corner, place.spacing, cells))
        for name, layer in layers.items():
            layer[rows, columns] = getattr(own, name)[: rows.stop - rows.start, : columns.stop - columns.start]
    return replace(maps, **layers)


def write_windows(fitted: Sequence[FittedWindow], focus: Focus, maps: GroundMaps, folder: Path | str) -> None:
    """Write window{k}.ply, its grid window{k}.exr, maps.exr and windows.json; the folder appears whole or not."""
    place = maps.exemplar
    layers = dict(zip("RGB", np.moveaxis(maps.colour, -1, 0), strict=True))
    layers |= {name: getattr(maps, name) for name in LAYERS} | ({} if maps.tilt is None else {"tilt": maps.tilt})
    with atomic_folder(folder) as part:
        for number, (field, grid) in enumerate(fitted):
            write_field(field, part / f"window{number}.ply")
            write_ground(grid, part / f"window{number}.exr")
        header = {name: repr(getattr(place, name)) for name in ("west", "south", "spacing")}
        stored = {name: layer[::-1].astype(np.float32) for name, layer in layers.items()}
        image_files.write_exr(part / "maps.exr", stored, header)
        tiled = [window.tiled for window in focus.windows]
        write_json(part / NAME, asdict(WindowsRecord(tiled, focus.spacing, focus.pixel)))


def read_windows(folder: Path | str) -> FocusedFields:
    """Read the windows of a fit. Raises: InputError: not readable, or not such a folder."""
    tiled = read_record(Path(folder, NAME), WindowsRecord, "fit the windows again").tiled
    files = [Path(folder, f"window{number}") for number in range(len(tiled))]
    fields = [(read_field(f"{file}.ply"), read_ground(f"{file}.exr")) for file in files]
    channels, header = image_files.read_exr(Path(folder, "maps.exr"))
    layers = {name: np.asarray(channel[::-1], float) for name, channel in channels.items()}
    west, south, spacing = (float(header[name]) for name in ("west", "south", "spacing"))
    height, surface, cover, known = (layers[name] for name in LAYERS)
    place = Exemplar(west, south, spacing, len(known))
    colour = np.dstack([layers[name] for name in "RGB"])
    maps = GroundMaps(colour, height, surface, cover, known > 0, place, layers.get("tilt"))
    return FocusedFields(fields, tiled, maps)
