"""Crops: small pictures around a point of the ground, of the terrain and of each patch in it laid whole."""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float, Float32, Int
from numpy import ndarray as Array

from dav_gswt.field import GaussianField
from dav_gswt.geometry import cameras
from dav_gswt.geometry.cameras import Camera
from dav_gswt.study.seams import rendering
from dav_gswt.study.seams.ground import Laid
from dav_gswt.study.seams.spatial_index import Seen
from dav_gswt.terrain.endless import EndlessTerrain

SIDE = 48  # pixels of a crop
MOST = 3  # patches of a crop that are told apart
FLATTEST = 0.6  # of the sine of the angle at which level ground is seen: what is flatter is not judged
SEEN = 0.25  # share of a pixel that a patch must have for the pixel to be its
FEWEST = 128  # cells: of tiles with fewer, a crop shows no larger a share than of one with so many


@dataclass(frozen=True)
class View:
    """How crops are looked at: `down` degrees below the horizon, towards `yaw` degrees from east, a finest cell
    `pixels` wide (more where tiles have fewer cells than FEWEST); from `floors` eye floors above the ground.
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
    """at: the point of the ground in its middle, in finest cells of the terrain. cells: those that its pixels see
    where nothing stands.
    """

    at: tuple[int, int]
    camera: Camera
    cells: Int[Array, "h w 2"]

    @property
    def box(self) -> Int[Array, "2 2"]:
        """South-western and north-eastern cell (x, y)."""
        return np.stack([self.cells.min((0, 1)), self.cells.max((0, 1))])


@dataclass(frozen=True)
class Shown:
    """What a crop shows of the terrain.

    patches: up to MOST that meet in it. patch: which of these a pixel shows, -1 for none. tile: two bits, the parities
    of the terrain's tile that a pixel shows. own: every patch's picture, laid whole over the crop.
    sources: the exemplar's cells under the crop in each, south-western and north-eastern.
    """

    crop: Crop
    picture: Float32[Array, "h w 3"]
    patches: list[int]
    patch: Int[Array, "h w"]
    tile: Int[Array, "h w"]
    own: Float32[Array, "k h w 3"]
    sources: Int[Array, "k 2 2"]

    @property
    def any(self) -> bool:
        """Whether it shows any of the patches: what stands between may hide them all."""
        return bool((self.patch >= 0).any())

    @property
    def masks(self) -> Float32[Array, "k h w"]:
        """Of each patch; a pixel that shows none of them counts for all by their share. They sum to 1."""
        mine = (self.patch == np.arange(len(self.patches))[:, None, None]).astype(np.float32)
        return np.where(self.patch >= 0, mine, self.share[:, None, None]).astype(np.float32)

    @property
    def share(self) -> Float[Array, "k"]:
        """Of each patch in the pixels."""
        counts = np.bincount(self.patch[self.patch >= 0], minlength=len(self.patches)).astype(float)
        return counts / counts.sum() if counts.sum() else np.full(len(counts), 1 / len(counts))


def crop(laid: Laid, terrain: EndlessTerrain, view: View, at: tuple[int, int], side: int = SIDE) -> Crop | None:
    """The crop around a point; None where a hill hides it, or it is seen at too flat an angle to be judged.

    side: in pixels; a larger one shows the same in its middle, and what lies around it.
    """
    spot = np.array(at, float) * laid.spacing
    (height,), (slope,) = terrain.heights.at(spot[:1], spot[1:])
    middle = np.array([*spot, height + laid.risen(at)])
    down, yaw = np.radians(view.down), np.radians(view.yaw)
    ahead = np.array([np.cos(down) * np.cos(yaw), np.cos(down) * np.sin(yaw), -np.sin(down)])
    far = view.floors * laid.eye_floor / np.sin(down)
    camera = cameras.pinhole(middle - far * ahead, middle, side, side, 60.0)
    focal = view.pixels * max(1.0, FEWEST / laid.plan.side) * far / laid.spacing
    camera = replace(camera, fx=focal, fy=focal)
    normal = np.array([-slope[0], -slope[1], 1.0]) / np.hypot(1.0, np.linalg.norm(slope))
    origin, ray = camera.rays()
    facing = -(ray @ normal)
    if (facing < FLATTEST * np.sin(down)).any() or _hidden(terrain, camera.centre, middle):
        return None
    hit = origin + ray * (((origin - middle) @ normal) / facing)[..., None]
    return Crop(at, camera, np.floor(hit[..., :2] / laid.spacing).astype(int))


def _hidden(terrain: EndlessTerrain, eye: Float[Array, "3"], point: Float[Array, "3"]) -> bool:
    between = eye + np.linspace(0, 0.95, 40)[:, None] * (point - eye)
    surface, _ = terrain.heights.at(between[:, 0], between[:, 1])
    return bool((between[:, 2] < surface).any())


def inside(laid: Laid, crop: Crop, origin: Int[Array, "2"]) -> bool:
    """Whether the exemplar, with its corner there, covers the crop's ground."""
    box = crop.box - origin
    return bool((box >= 0).all() and (box < laid.source.exemplar.cells).all())


def meeting(laid: Laid, crop: Crop) -> list[int] | None:
    """The patches that meet in a crop, by falling share; None where it leaves the window, or a patch ends in it."""
    index = crop.cells - laid.first
    if (index < 0).any() or (index >= len(laid.patch)).any():
        return None
    found, counts = np.unique(laid.patch[index[..., 1], index[..., 0]], return_counts=True)
    patches = found[np.argsort(-counts, kind="stable")][:MOST].tolist()
    return patches if all(inside(laid, crop, laid.origins[p]) for p in patches) else None


def picture(laid: Laid, terrain: EndlessTerrain, crop: Crop) -> Float32[Array, "h w 3"]:
    """The crop as the terrain shows it, and nothing more."""
    pieces = rendering.of_terrain(terrain, crop.camera, _seen(laid, crop), laid.tiles)
    return rendering.drawn(terrain, pieces, crop.camera, laid.colour)[0]


def shown(laid: Laid, terrain: EndlessTerrain, crop: Crop, patches: list[int], border: bool = False) -> Shown:
    """The crop as the terrain shows it, and its patches whole, each with the mean change that its cells have there.

    border: also tell which of the terrain's tiles each pixel shows.
    """
    pieces = rendering.of_terrain(terrain, crop.camera, _seen(laid, crop), laid.tiles)

    looks = [lambda field, eye: _painted(_patch_at(laid, field, eye)[:, None] == patches)]
    looks += [lambda field, eye: _painted(_cells_of(field, eye, terrain.side) % 2 == 1)] * border
    picture, codes, *sides = rendering.drawn(terrain, pieces, crop.camera, laid.colour, looks)
    patch = np.where(codes.max(-1) > SEEN, codes.argmax(-1), -1)
    tile = (sides[0][..., :2] > 0.5) @ np.array([1, 2]) if border else np.zeros_like(patch)
    own = [whole(laid, terrain, crop, laid.origins[p], change(laid, crop, p), pieces) for p in patches]
    return Shown(crop, picture, patches, patch, tile, np.stack(own), crop.box - laid.origins[patches][:, None])


def whole(
    laid: Laid,
    terrain: EndlessTerrain,
    crop: Crop,
    origin: Int[Array, "2"],
    changed: Float[Array, "4"],
    pieces: list[rendering.Piece] | None = None,
) -> Float32[Array, "h w 3"]:
    """The exemplar in the crop's place, with its corner in that cell of the terrain.

    changed: its colours and heights, by so much throughout. pieces: the terrain's there.
    """
    seen = _seen(laid, crop)
    pieces = pieces or rendering.of_terrain(terrain, crop.camera, seen, laid.tiles)
    middle = tuple(v // laid.plan.side for v in crop.at)
    (like,) = [piece for piece in pieces if piece.cell == middle]
    corner = np.array([*(origin * laid.spacing), 0.0])
    piece = rendering.of_patch(laid.source.levels, corner, like, changed, seen)
    return rendering.drawn(terrain, [piece], crop.camera, laid.colour)[0]


def _seen(laid: Laid, crop: Crop) -> Seen:
    return Seen.of(crop.camera, (crop.box + [[-1], [2]]) * laid.spacing)


def change(laid: Laid, crop: Crop, patch: int) -> Float[Array, "4"]:
    """Mean correction of a patch's cells in the crop; 0 where none of them is known."""
    x, y = np.moveaxis(crop.cells - laid.first, -1, 0)
    mine = laid.patch[y, x] == patch
    x, y = x[mine], y[mine]
    found = laid.correction[laid.tile[y, x], y % laid.plan.side, x % laid.plan.side]
    known = found[np.isfinite(found).all(1)]
    return known.mean(0) if len(known) else np.zeros(4)


def _cells_of(field: GaussianField, eye: Float[Array, "3"], size: float) -> Int[Array, "n 2"]:
    """Cells of a size that Gaussians, counted from the eye, lie in."""
    return np.floor((field.means[:, :2] + eye[:2]) / size).astype(int)


def _patch_at(laid: Laid, field: GaussianField, eye: Float[Array, "3"]) -> Int[Array, "n"]:
    column, row = (_cells_of(field, eye, laid.spacing) - laid.first).T
    inside = (column >= 0) & (row >= 0) & (column < len(laid.patch)) & (row < len(laid.patch))
    return np.where(inside, laid.patch[row * inside, column * inside], -1)


def _painted(channels: Array) -> Float32[Array, "n 3"]:
    colours = np.zeros((len(channels), 3), np.float32)
    colours[:, : channels.shape[1]] = channels
    return colours
