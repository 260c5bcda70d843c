"""Maps of an exemplar, one value a finest cell, row 0 in the south; and masks that people draw over it."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from jaxtyping import Bool, Float, Int
from numpy import ndarray as Array
from scipy.ndimage import distance_transform_edt, gaussian_filter, map_coordinates

from dav_gswt.errors import InputError
from dav_gswt.field import GaussianField
from dav_gswt.images import image_files
from dav_gswt.photos.training_views import TrainingView
from dav_gswt.reconstruction import top_view
from dav_gswt.reconstruction.ground import Ground
from dav_gswt.reconstruction.photo_colours import median_colours
from dav_gswt.tiles.compose import compute_cover, compute_ground_maps
from dav_gswt.tiles.layout import Exemplar

UNKNOWN = 0.9  # uncertainty from which nothing is known of a cell
PLANNED = 384  # cells along the side of the maps that windows are chosen by: about what grain is described on
EXCLUDE = "exclude"  # name of the mask of ground that is shown nowhere
NO_CLASS = -1  # of cells that belong to no material
HALF = 0.5  # brightness from which a pixel of a mask counts
ALIKE = 0.4  # blur of values for wider cells, in those
ASPECT = 0.01  # a mask that is less square does not show the exemplar


@dataclass(frozen=True)
class GroundMaps:
    """Maps of an exemplar.

    Attributes:
        colour: seen from straight above, sRGB in [0, 1]; holes have the colour of the nearest cell.
        height: of the ground discs.
        surface: height of the ground or of what stands on it, seen from straight above.
        cover: share of a cell that is hidden by what stands there.
        known: cells that a photo saw.
        exemplar: its place and the width of its cells.
        tilt: the widest angle from the vertical, in degrees, that a photo saw a cell from; None: not known.
    """

    colour: Float[Array, "m m 3"]
    height: Float[Array, "m m"]
    surface: Float[Array, "m m"]
    cover: Float[Array, "m m"]
    known: Bool[Array, "m m"]
    exemplar: Exemplar
    tilt: Float[Array, "m m"] | None = None

    @property
    def cells(self) -> int:
        return len(self.known)

    def crop(self, row: int, column: int, cells: int) -> "GroundMaps":
        """The maps of a square within the exemplar."""
        own, box = self.exemplar, np.s_[row : row + cells, column : column + cells]
        corner = own.west + column * own.spacing, own.south + row * own.spacing
        maps = {name: value[box] for name, value in vars(self).items() if isinstance(value, Array)}
        return replace(self, **maps, exemplar=Exemplar(*corner, own.spacing, cells))


@dataclass(frozen=True)
class Surroundings:
    """What single things on the ground are judged by, of every cell.

    Attributes:
        colour: sRGB in [0, 1].
        features: weighed CIELAB.
        rise: how far the surface lies above the ground around it, in cells.
        materials: the nearest material.
        ground: whether it is ground of a material.
        pieces: whether it belongs to a small piece of one material within another.
        strips: whether it belongs to a strip.
        known: whether a photo saw it.
        rough: numbers of the materials that are dense with growth or stones.
    """

    colour: Float[Array, "m m 3"]
    features: Float[Array, "m m k"]
    rise: Float[Array, "m m"]
    materials: Int[Array, "m m"]
    ground: Bool[Array, "m m"]
    pieces: Bool[Array, "m m"]
    strips: Bool[Array, "m m"]
    known: Bool[Array, "m m"]
    rough: frozenset[int]

    def material_of(self, own: Bool[Array, "m m"]) -> int:
        """The material that most of a thing lies on."""
        return int(np.bincount(self.materials[own]).argmax())

    def plain(self, material: int) -> Bool[Array, "m m"]:
        """Ground of a material without things."""
        return self.ground & (self.materials == material)


def unite(parts: Sequence[Bool[Array, "m m"]], shape: tuple[int, ...]) -> Bool[Array, "m m"]:
    """Cells of any of these parts; none if there are no parts."""
    return np.any([np.zeros(shape, bool), *parts], axis=0)


def find_wide_parts(cells: Bool[Array, "m m"], width: float) -> Bool[Array, "m m"]:
    """Cells of a region that lie in a disc of some diameter within it (its opening); it goes on beyond the border."""
    inner = distance_transform_edt(cells) >= width / 2
    return cells & (distance_transform_edt(~inner) < width / 2) if inner.any() else inner


def measure_ground(field: GaussianField, grid: Ground) -> GroundMaps:
    """The maps of a field's exemplar."""
    exemplar = Exemplar.from_grid(grid)
    above = top_view.render_exemplar(field, grid)
    _, height = compute_ground_maps(field, exemplar)
    known = (above.alpha > top_view.MIN_ALPHA) & (above.uncertainty < UNKNOWN) & np.isfinite(height)
    if not known.any():
        known = np.ones_like(known)
    nearest = tuple(distance_transform_edt(~known, return_distances=False, return_indices=True))
    height = np.nan_to_num(height[nearest].astype(float))
    colour = np.clip(above.colour[nearest].astype(float), 0, 1)
    surface = above.height[nearest].astype(float)
    return GroundMaps(colour, height, surface, compute_cover(field, exemplar, height), known, exemplar)


def sharpen_maps(maps: GroundMaps, views: list[TrainingView], cells: int = PLANNED) -> GroundMaps:
    """Finer maps of the same ground, with the colours of the photos.

    The maps of a draft are as soft as its cells. Each cell of the finer ones has the median colour of the photos that
    show its surface; heights and cover are the draft's. views: at one exposure. cells: along the side.
    """
    place = maps.exemplar
    fine = Exemplar(place.west, place.south, place.spacing * maps.cells / cells, cells)
    coarse = resample_maps(maps, fine)
    middles = (np.arange(cells) + 0.5) * fine.spacing
    x, y = np.meshgrid(place.west + middles, place.south + middles)
    points = np.stack([x.ravel(), y.ravel(), coarse.surface.ravel()], 1)
    colour, seen = median_colours(points, views)
    colour = np.where(seen[:, None], colour, coarse.colour.reshape(-1, 3)).reshape(cells, cells, 3).astype(float)
    known = coarse.known & seen.reshape(cells, cells)
    known = known if known.any() else np.ones_like(known)
    tilt = measure_tilt(points, views).reshape(cells, cells)
    return replace(coarse, colour=np.clip(colour, 0, 1), known=known, tilt=tilt)


def measure_tilt(points: Float[Array, "n 3"], views: Sequence[TrainingView]) -> Float[Array, "n"]:
    """The widest angle from the vertical, in degrees, from which a photo looks at each point; 0 where none does."""
    widest = np.zeros(len(points))
    for camera in (view.camera for view in views):
        pixel, depth = camera.project(points)
        inside = (depth > 0) & (pixel >= 0).all(1) & (pixel < [camera.width, camera.height]).all(1)
        way = camera.centre - points
        angle = np.degrees(np.arctan2(np.hypot(way[:, 0], way[:, 1]), way[:, 2]))
        widest = np.where(inside, np.maximum(widest, angle), widest)
    return widest


def resample(layer: Array, place: Exemplar, at: Exemplar) -> Float[Array, "n n"]:
    """A layer of values at the cells of another exemplar over the same ground, as if both were blurred alike."""
    middles = (np.arange(at.cells) + 0.5) * at.spacing
    row = (at.south - place.south + middles) / place.spacing - 0.5
    column = (at.west - place.west + middles) / place.spacing - 0.5
    wider = at.spacing / place.spacing
    values = gaussian_filter(layer.astype(float), ALIKE * wider, mode="nearest") if wider > 1 else layer.astype(float)
    return map_coordinates(values, np.meshgrid(row, column, indexing="ij"), order=1, mode="nearest")


def resample_maps(maps: GroundMaps, at: Exemplar) -> GroundMaps:
    """The maps at the cells of another exemplar over the same ground."""
    height, surface, cover, known = (
        resample(layer, maps.exemplar, at) for layer in (maps.height, maps.surface, maps.cover, maps.known)
    )
    colour = np.stack([resample(layer, maps.exemplar, at) for layer in np.moveaxis(maps.colour, -1, 0)], -1)
    tilt = None if maps.tilt is None else resample(maps.tilt, maps.exemplar, at)
    return GroundMaps(colour, height, surface, cover, known >= HALF, at, tilt)


@dataclass(frozen=True)
class GroundMasks:
    """Masks over the cells of an exemplar.

    materials: by name; where two overlap, the first counts. If there are none, materials are found
    by their looks.
    excluded: ground that is shown nowhere.
    """

    materials: Mapping[str, Bool[Array, "m m"]]
    excluded: Bool[Array, "m m"]

    def label(self) -> tuple[Int[Array, "m m"], list[str]]:
        """Number of each cell's material, by descending share, or NO_CLASS; and the materials' names."""
        labels = np.full(self.excluded.shape, NO_CLASS)
        names = list(self.materials)
        for number in reversed(range(len(names))):
            labels[self.materials[names[number]]] = number
        labels[self.excluded] = NO_CLASS
        counts = [int((labels == number).sum()) for number in range(len(names))]
        order = sorted((k for k in range(len(names)) if counts[k]), key=lambda k: -counts[k])
        place = np.full(len(names) + 1, NO_CLASS)  # the last entry serves the cells without a material
        place[order] = np.arange(len(order))
        return place[labels], [names[k] for k in order]


def read_masks(files: Mapping[str, Path | str], cells: int) -> GroundMasks:
    """Read masks that were drawn over `ground.png`: north up, white where the ground is what the name says.

    They may have any number of pixels, as long as they are square.
    Raises: InputError: a mask is not readable, not square or white nowhere, or together they leave no ground.
    """
    masks = {name: _read_mask(path, cells) for name, path in files.items()}
    excluded = masks.pop(EXCLUDE, np.zeros((cells, cells), bool))
    if (excluded if not masks else ~np.any(list(masks.values()), axis=0) | excluded).all():
        raise InputError(f"{', '.join(str(path) for path in files.values())}: these masks leave no ground to tile")
    return GroundMasks(masks, excluded)


def _read_mask(path: Path | str, cells: int) -> Bool[Array, "m m"]:
    """One mask at the resolution of the exemplar."""
    bright = image_files.read_photo(path).mean(-1)
    height, width = bright.shape
    if abs(width / height - 1) > ASPECT:
        raise InputError(
            f"{path}: is {width} x {height} pixels; a mask of materials is square, drawn over materials/ground.png"
        )
    at = (np.arange(cells) + 0.5) / cells
    mask = bright[np.ix_((at * height).astype(int), (at * width).astype(int))][::-1] >= HALF
    if not mask.any():
        raise InputError(f"{path}: is white nowhere; paint what it names white and the rest black")
    return mask
