"""Crops: small pictures around a point of the ground, of the terrain and of each of its patches without a seam."""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float, Float32, Int
from numpy import ndarray as Array

from dav_gswt.field import GaussianField
from dav_gswt.geometry import cameras
from dav_gswt.geometry.cameras import Camera
from dav_gswt.terrain.endless import EndlessTerrain
from dav_gswt_study.seams import rendering
from dav_gswt_study.seams.placed_tiles import PlacedTiles
from dav_gswt_study.seams.rendering import Footprint

SIDE = 48  # pixels of a crop
MAX_PATCHES = 3  # patches of a crop that are distinguished
MIN_SINE = 0.6  # smallest sine of the viewing angle, over that of level ground: flatter crops are left out
MIN_SHARE = 0.25  # share of a pixel above which it belongs to a patch
MIN_CELLS = 128  # cells a tile: of tiles with fewer, a crop shows no larger a share than of one with so many


@dataclass(frozen=True)
class View:
    """The camera of crops: `down` degrees below the horizon, towards `yaw` degrees from east, `floors` eye floors above
    the ground. A finest cell is `pixels` wide (more where tiles have fewer cells than MIN_CELLS).
    """

    name: str
    down: float
    yaw: float
    pixels: float
    floors: float


VIEWS = (
    View("near", 40.0, 20.0, 4.0, 2.0),
    View("walker", 20.0, 60.0, 5.26, 1.0),  # as the terrain's still shows that ground: 316 cells away, f = 1663 pixels
    View("top", 89.99, 90.0, 4.0, 3.0),
)


@dataclass(frozen=True)
class Crop:
    """at: the point of the ground in its middle, in finest cells of the terrain. cells: those under its pixels, without
    anything above the ground.
    """

    at: tuple[int, int]
    camera: Camera
    cells: Int[Array, "h w 2"]

    @property
    def box(self) -> Int[Array, "2 2"]:
        """South-western and north-eastern cell (x, y)."""
        return np.stack([self.cells.min((0, 1)), self.cells.max((0, 1))])


@dataclass(frozen=True)
class RenderedCrop:
    """A crop of the terrain as rendered, and its patches.

    patches: up to MAX_PATCHES that meet in it. patch: the one that a pixel shows, -1 for none. tile: two bits, the
    parities of the tile that a pixel shows. own: the picture of every patch alone, over the whole crop.
    sources: the exemplar's cells under the crop in each patch, south-western and north-eastern.
    """

    crop: Crop
    picture: Float32[Array, "h w 3"]
    patches: list[int]
    patch: Int[Array, "h w"]
    tile: Int[Array, "h w"]
    own: Float32[Array, "k h w 3"]
    sources: Int[Array, "k 2 2"]

    @property
    def shows_patch(self) -> bool:
        """Whether any patch is visible: objects in front may hide them all."""
        return bool((self.patch >= 0).any())

    @property
    def masks(self) -> Float32[Array, "k h w"]:
        """Weights of the patches by pixel, which sum to 1; a pixel without a patch counts for all by their share."""
        mine = (self.patch == np.arange(len(self.patches))[:, None, None]).astype(np.float32)
        return np.where(self.patch >= 0, mine, self.share[:, None, None]).astype(np.float32)

    @property
    def share(self) -> Float[Array, "k"]:
        """Share of the pixels that show each patch."""
        counts = np.bincount(self.patch[self.patch >= 0], minlength=len(self.patches)).astype(float)
        return counts / counts.sum() if counts.sum() else np.full(len(counts), 1 / len(counts))


def make_crop(
    placed: PlacedTiles, terrain: EndlessTerrain, view: View, at: tuple[int, int], side: int = SIDE
) -> Crop | None:
    """The crop around a point; None where a hill hides it, or the viewing angle is too flat.

    side: in pixels; a larger one shows the same in its middle, and more around it.
    """
    spot = np.array(at, float) * placed.spacing
    (height,), (slope,) = terrain.heights.at(spot[:1], spot[1:])
    middle = np.array([*spot, height + placed.mean_height(at)])
    down, yaw = np.radians(view.down), np.radians(view.yaw)
    ahead = np.array([np.cos(down) * np.cos(yaw), np.cos(down) * np.sin(yaw), -np.sin(down)])
    far = view.floors * placed.eye_floor / np.sin(down)
    camera = cameras.pinhole(middle - far * ahead, middle, side, side, 60.0)
    focal = view.pixels * max(1.0, MIN_CELLS / placed.plan.side) * far / placed.spacing
    camera = replace(camera, fx=focal, fy=focal)
    normal = np.array([-slope[0], -slope[1], 1.0]) / np.hypot(1.0, np.linalg.norm(slope))
    origin, ray = camera.rays()
    facing = -(ray @ normal)
    if (facing < MIN_SINE * np.sin(down)).any() or _is_hidden(terrain, camera.centre, middle):
        return None
    hit = origin + ray * (((origin - middle) @ normal) / facing)[..., None]
    return Crop(at, camera, np.floor(hit[..., :2] / placed.spacing).astype(int))


def _is_hidden(terrain: EndlessTerrain, eye: Float[Array, "3"], point: Float[Array, "3"]) -> bool:
    between = eye + np.linspace(0, 0.95, 40)[:, None] * (point - eye)
    surface, _ = terrain.heights.at(between[:, 0], between[:, 1])
    return bool((between[:, 2] < surface).any())


def covers_crop(placed: PlacedTiles, crop: Crop, origin: Int[Array, "2"]) -> bool:
    """Whether the exemplar, with its corner there, covers the crop's ground."""
    box = crop.box - origin
    return bool((box >= 0).all() and (box < placed.source.exemplar.cells).all())


def find_patches(placed: PlacedTiles, crop: Crop) -> list[int] | None:
    """The patches of a crop, by decreasing share; None where it leaves the window, or a patch ends in it."""
    index = crop.cells - placed.first
    if (index < 0).any() or (index >= len(placed.patch)).any():
        return None
    values, counts = np.unique(placed.patch[index[..., 1], index[..., 0]], return_counts=True)
    patches = values[np.argsort(-counts, kind="stable")][:MAX_PATCHES].tolist()
    return patches if all(covers_crop(placed, crop, placed.origins[p]) for p in patches) else None


def find_cut(
    placed: PlacedTiles, terrain: EndlessTerrain, view: View, at: tuple[int, int]
) -> tuple[Crop, list[int]] | None:
    """The crop around a point on a cut, and its patches; None where it cannot be judged, or shows one patch alone."""
    crop = make_crop(placed, terrain, view, at)
    patches = find_patches(placed, crop) if crop else None
    return (crop, patches) if crop and patches and len(patches) > 1 else None


def render_crop(placed: PlacedTiles, terrain: EndlessTerrain, crop: Crop) -> Float32[Array, "h w 3"]:
    """The picture of a crop of the terrain."""
    pieces = rendering.collect_pieces(terrain, crop.camera, _make_footprint(placed, crop), placed.tiles)
    return rendering.render_pieces(terrain, pieces, crop.camera, placed.colour)[0]


def render_patches(
    placed: PlacedTiles, terrain: EndlessTerrain, crop: Crop, patches: list[int], border: bool = False
) -> RenderedCrop:
    """The picture of a crop, and of each of its patches alone, with the mean correction of its cells there.

    border: also find which of the terrain's tiles each pixel shows.
    """
    pieces = rendering.collect_pieces(terrain, crop.camera, _make_footprint(placed, crop), placed.tiles)

    recolourings = [lambda field, eye: _encode_channels(_find_patch(placed, field, eye)[:, None] == patches)]
    recolourings += [lambda field, eye: _encode_channels(_find_cells(field, eye, terrain.side) % 2 == 1)] * border
    picture, codes, *sides = rendering.render_pieces(terrain, pieces, crop.camera, placed.colour, recolourings)
    patch = np.where(codes.max(-1) > MIN_SHARE, codes.argmax(-1), -1)
    tile = (sides[0][..., :2] > 0.5) @ np.array([1, 2]) if border else np.zeros_like(patch)
    (middle,) = [piece for piece in pieces if piece.cell == _find_middle(placed, crop)]
    own = [
        render_patch(placed, terrain, crop, placed.origins[p], mean_correction(placed, crop, p), middle)
        for p in patches
    ]
    return RenderedCrop(crop, picture, patches, patch, tile, np.stack(own), crop.box - placed.origins[patches][:, None])


def render_patch(
    placed: PlacedTiles,
    terrain: EndlessTerrain,
    crop: Crop,
    origin: Int[Array, "2"],
    correction: Float[Array, "4"],
    template: rendering.Piece | None = None,
) -> Float32[Array, "h w 3"]:
    """The picture of the exemplar alone, with its corner in that cell of the terrain.

    correction: added to all its colours and heights. template: the terrain's cell under the crop's middle, if known.
    """
    footprint = _make_footprint(placed, crop)
    template = template or rendering.describe_cell(terrain, crop.camera.centre, _find_middle(placed, crop))
    corner = np.array([*(origin * placed.spacing), 0.0])
    piece = rendering.make_patch_piece(placed.source.levels, corner, template, correction, footprint)
    return rendering.render_pieces(terrain, [piece], crop.camera, placed.colour)[0]


def _find_middle(placed: PlacedTiles, crop: Crop) -> tuple[int, int]:
    """The cell of the terrain under the crop's middle."""
    return crop.at[0] // placed.plan.side, crop.at[1] // placed.plan.side


def _make_footprint(placed: PlacedTiles, crop: Crop) -> Footprint:
    return Footprint.from_camera(crop.camera, (crop.box + [[-1], [2]]) * placed.spacing)


def mean_correction(placed: PlacedTiles, crop: Crop, patch: int) -> Float[Array, "4"]:
    """Mean correction of a patch's cells in the crop; 0 where none of them is known."""
    x, y = np.moveaxis(crop.cells - placed.first, -1, 0)
    mine = placed.patch[y, x] == patch
    x, y = x[mine], y[mine]
    values = placed.correction[placed.tile[y, x], y % placed.plan.side, x % placed.plan.side]
    known = values[np.isfinite(values).all(1)]
    return known.mean(0) if len(known) else np.zeros(4)


def _find_cells(field: GaussianField, eye: Float[Array, "3"], size: float) -> Int[Array, "n 2"]:
    """Cells of a size that contain the Gaussians, whose means are relative to the eye."""
    return np.floor((field.means[:, :2] + eye[:2]) / size).astype(int)


def _find_patch(placed: PlacedTiles, field: GaussianField, eye: Float[Array, "3"]) -> Int[Array, "n"]:
    column, row = (_find_cells(field, eye, placed.spacing) - placed.first).T
    inside = (column >= 0) & (row >= 0) & (column < len(placed.patch)) & (row < len(placed.patch))
    return np.where(inside, placed.patch[row * inside, column * inside], -1)


def _encode_channels(channels: Array) -> Float32[Array, "n 3"]:
    colours = np.zeros((len(channels), 3), np.float32)
    colours[:, : channels.shape[1]] = channels
    return colours
