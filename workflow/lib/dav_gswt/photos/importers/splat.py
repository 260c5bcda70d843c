"""Import of a finished Gaussian field of any training program: into the ground frame, without far floaters."""

import logging
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from jaxtyping import Bool, Float
from numpy import ndarray as Array
from scipy.ndimage import binary_closing, distance_transform_edt
from scipy.spatial.transform import Rotation
from scipy.special import expit

from dav_gswt.errors import InputError
from dav_gswt.field import GaussianField
from dav_gswt.geometry.scene_frame import SceneFrame, SourceFrame, Square
from dav_gswt.photos import ground_frame
from dav_gswt.photos.ground_frame import (
    find_extent,
    fit_plane,
    make_upright_rotation,
    place_square,
    rotate_about_z,
)

_log = logging.getLogger(__name__)

UP = (0.0, -1.0, 0.0)  # of fields trained from COLMAP: its first camera's y axis points down
UP_OF_SPZ = (0.0, 1.0, 0.0)  # as its description has it
OPAQUE, FAINTEST = 0.5, 0.1  # peak opacity from which a Gaussian counts as surface; where most are fainter
SURFACE = 75  # percentile of the opacities that takes OPAQUE's place where it is lower (fused 3D filters)
LEAST = 100  # opaque Gaussians, below which there is nothing to find a ground in
ROBUST = (1, 99)  # percentiles of the opaque Gaussians' positions between which the scene lies
MARGIN = 0.2  # kept around it, as a share of its size; what is farther off is a floater, a sky or a far background
SPARSER = 0.75  # exponent: where Gaussians grow fewer than with this power of the distance, the scene ends
COARSE = 2.0  # times the median size, from which a Gaussian counts less
GRAIN = 10  # cubes in the median distance
LEAST_SHARE = 0.1  # of what counts that the scene holds
NOTED = 0.005  # share of dropped Gaussians from which a warning says so
STANDS, TALL = 5.0, 0.2  # spreads of the ground above which a thing stands; share of the size at which it is capped
SURE = 0.75  # share of what stands that must be on one side
WALLS = 3.0  # times the spread of the best plane that a level one may have
LARGEST = 0.5  # standard deviation of a Gaussian, as a share of the scene's size; larger ones are haze
ROUGHEST = 0.1  # spread of the surface about its plane, as a share of the scene's size; above it there is no ground
VIEW = 60.0  # degrees across the virtual camera's picture that the exemplar fills: it gives the flying height
CELLS, COARSE_CELLS = 256, 128  # of the map of opaque ground along its longer side; while directions are tried
DISC = 2.0  # standard deviations of a disc that count as covered ground
WIDEST_DISC = 6  # cells, the most that a single Gaussian covers


def fit_field_frame(
    field: GaussianField,
    rng: np.random.Generator,
    up: Sequence | None = None,
    crop: Sequence | None = None,
    origin: Float[Array, "3"] | None = None,
    usual: Sequence = UP,
) -> tuple[GaussianField, SceneFrame]:
    """The field in its ground frame, and this frame.

    z points from the robust plane through the opaque Gaussians to the side of `up`, three numbers of any length; if it
    is None, to the side on which things stand, and in doubt to that of `usual`. x and y run so that the exemplar, the
    largest square of opaque ground, is as large as can be; the origin is its middle. No camera is known, so the flying
    height, which is the unit, is a virtual one: from there a picture of VIEW degrees shows just the exemplar.
    crop: lowest and highest corner of the scene in the file; if it is None, the dense part is the scene.
    field: of degree 0. origin: of its positions in the file.
    Raises: InputError: too few opaque Gaussians, positions too coarse for their sizes, or no ground.
    """
    before = len(field)
    origin = np.zeros(3) if origin is None else origin
    field = field[_select_scene(field, origin, crop)]
    field, relief, level, offset = _level_field(field, up, usual, rng)
    field, side, height, turn, middle = _center_on_exemplar(field)
    extent = find_extent(*_opaque_ground(*_project_discs(field), CELLS))
    side, relief = float(side / height), float(relief / height)
    place = origin + (middle @ turn + [0.0, 0.0, offset]) @ level
    x, y, z = (turn @ level).tolist()
    frame = SceneFrame(
        kind="field",
        unit="flying height",
        flying_height=1.0,
        exemplar=Square(-side / 2, -side / 2, side),
        extent=extent,
        relief=relief,
        gaussians=len(field),
        removed=before - len(field),
        source=SourceFrame(tuple(place.tolist()), (tuple(x), tuple(y), tuple(z)), float(height)),
    )
    _log.info("%d of %d Gaussians are kept; relief %.3f flying heights", len(field), before, relief)
    return field, frame


def _center_on_exemplar(
    field: GaussianField,
) -> tuple[GaussianField, float, float, Float[Array, "3 3"], Float[Array, "3"]]:
    """A level field turned so that its exemplar is largest, with that square's middle as origin and the flying height
    as unit; the square's side and the flying height in the old unit, the turn, and the middle in the turned frame."""
    turns = np.arange(0.0, 90.0, ground_frame.TURN)
    places, widths = _project_discs(field)
    sides = [
        place_square(*_opaque_ground(places @ rotate_about_z(turn)[:2, :2].T, widths, COARSE_CELLS))[2]
        for turn in turns
    ]
    turn = rotate_about_z(turns[np.argmax(sides)])
    west, south, side = place_square(*_opaque_ground(places @ turn[:2, :2].T, widths, CELLS))
    height = 0.5 * side / np.tan(np.radians(0.5 * VIEW))
    middle = np.array([west + side / 2, south + side / 2, 0.0])
    return _transform_field(field, turn, 1 / height, -middle / height), side, height, turn, middle


def _select_scene(field: GaussianField, origin: Float[Array, "3"], crop: Sequence | None) -> Bool[Array, "n"]:
    """Gaussians of the scene: those in the crop or the dense part, and not as large as it. Says what is dropped."""
    surface, where = _find_surface(field), ""
    box = None if crop is None else np.array(crop, float) - origin
    if box is not None:
        surface, where = surface & _lies_in(field, box), " in the box `crop`"
    if (count := int(surface.sum())) < LEAST:
        raise InputError(f"the field has {count} opaque Gaussians{where}; a surface of at least {LEAST} is needed")
    sizes = np.exp(field.log_scales[surface].max(1))
    if box is None:
        places = field.means[surface]
        low, high = np.percentile(places[_find_dense_part(places, sizes)], ROBUST, axis=0)
        size = float((high - low).max())
        box = np.stack([low - MARGIN * size, high + MARGIN * size])
    else:
        size = float(np.ptp(box, axis=0).max())
    step = float(np.spacing(np.abs(field.means[surface]).max()))
    if step > np.median(sizes):
        raise InputError(
            f"its positions are 32-bit numbers so far from 0 that they are {step:g} apart, more than its Gaussians "
            "are wide; export it with double coordinates, or moved near 0"
        )
    inside = _lies_in(field, box) & (field.log_scales.max(1) <= np.log(LARGEST * size))
    dropped = len(inside) - int(inside.sum())
    _log.log(
        logging.WARNING if crop is None and dropped > NOTED * len(inside) else logging.INFO,
        "%d of %d Gaussians (%.1f %%) surround the scene or are as large as it (sky, background, haze) and are "
        "dropped; kept is the box %s of the file (another: config, scenes, crop)",
        *(dropped, len(inside), 100 * dropped / len(inside), np.round(box + origin, 2).tolist()),
    )
    return inside


def _lies_in(field: GaussianField, box: Float[Array, "2 3"]) -> Bool[Array, "n"]:
    return ((field.means >= box[0]) & (field.means <= box[1])).all(1)


def _find_dense_part(places: Float[Array, "n 3"], sizes: Float[Array, "n"]) -> Bool[Array, "n"]:
    """Which Gaussians lie within the distance r from their median at which N(r) / r^SPARSER is largest.

    N sums over cubes with a side of 1 / GRAIN of the median distance. A cube counts as 1 from half as many Gaussians as
    the cube of a typical one has, so that detail counts no more than plain ground, and less with fewer. Gaussians
    COARSE times as large as the median one and larger count less in proportion. N grows faster than r^SPARSER over
    ground that is evenly dense, be it a square or a strip, and slower over what surrounds it: a shell of sky, a
    background that is coarser the farther it is, floaters.
    """
    centred = places.astype(float) - np.median(places, axis=0)
    away = np.linalg.norm(centred, axis=1)
    cube = float(np.median(away)) / GRAIN + 1e-12
    cell = np.clip(np.floor(centred / cube), -(1 << 20), (1 << 20) - 1).astype(np.int64) + (1 << 20)
    _, own, counts = np.unique(cell @ [1 << 42, 1 << 21, 1], return_inverse=True, return_counts=True)
    weights = 1 / np.maximum(counts, 0.5 * np.median(counts[own]))[own]
    weights *= np.minimum(1, COARSE * np.median(sizes) / sizes)
    order = np.argsort(away, kind="stable")
    summed = np.cumsum(weights[order])
    score = summed / np.maximum(away[order], cube) ** SPARSER
    least = int(np.searchsorted(summed, LEAST_SHARE * summed[-1]))
    return away <= away[order[least + score[least:].argmax()]]


def _level_field(
    field: GaussianField, up: Sequence | None, usual: Sequence, rng: np.random.Generator
) -> tuple[GaussianField, float, Float[Array, "3 3"], float]:
    """The field with z up and its plane at 0, its surface's spread about the plane, the turn, and the plane's height
    before it was moved."""
    surface = field.means[_find_surface(field)].astype(float)
    size = float(np.ptp(np.percentile(surface, ROBUST, axis=0), axis=0).max())
    if up is not None:
        normal, offset, spread = fit_plane(surface, rng, np.array(up, float))
    else:
        normal, offset, spread = _find_ground(surface, size, np.array(usual, float), rng)
    if spread > ROUGHEST * size:
        across = " across the direction `up`" if up is not None else ""
        raise InputError(
            f"the field has no ground{across}; give the direction that points up in the file "
            "(config: scenes, up), for instance [0, 0, 1], or the box of its ground (config: scenes, crop)"
        )
    axes = np.eye(3)
    east = axes[0] if abs(normal[0]) < 0.9 else axes[1]
    level = make_upright_rotation(normal, east)
    return _transform_field(field, level, 1.0, np.array([0.0, 0.0, -offset])), spread, level, offset


def _find_ground(
    surface: Float[Array, "n 3"], size: float, usual: Float[Array, "3"], rng: np.random.Generator
) -> tuple[Float[Array, "3"], float, float]:
    """The plane of the ground, normal upwards, without a word on where up is: normal, offset and spread.

    It is the plane that fits best, unless one level by the usual axes fits nearly as well (a street between walls). The
    side on which things stand is up, and in doubt the usual one.
    """
    normal, offset, spread = fit_plane(surface, rng)
    if abs(normal @ usual) < np.sqrt(0.5) * np.linalg.norm(usual):
        try:
            level = fit_plane(surface, rng, usual)
        except InputError:  # no plane of the sample is level
            level = None
        if level and level[2] <= min(WALLS * spread, ROUGHEST * size):
            normal, offset, spread = level
    axis = int(np.abs(normal).argmax())
    towards = usual[axis] if abs(usual[axis]) > 0.5 * np.linalg.norm(usual) else 1.0
    if normal[axis] * towards < 0:
        normal, offset = -normal, -offset
    share = _weigh_sides(surface @ normal - offset, spread, size)
    if share < 1 - SURE:
        normal, offset = -normal, -offset
    where, turned = ((np.round(v, 2) + 0.0).tolist() for v in (normal, -normal))
    if 1 - SURE <= share <= SURE:
        _log.warning(
            "up is taken to be %s in the file, as is usual: nothing tells which side of the ground is up; "
            "if the terrain is upside down, give `up: %s` (config: scenes, up)",
            *(where, turned),
        )
    else:
        _log.info("up is %s in the file: things stand on that side (config: scenes, up)", where)
    return normal, offset, spread


def _weigh_sides(heights: Float[Array, "n"], spread: float, size: float) -> float:
    """The share of what stands out of a plane that does so at positive heights; a half if nothing does."""
    beyond = np.clip(np.abs(heights) - STANDS * spread, 0, TALL * size)
    above, both = beyond[heights > 0].sum(), beyond.sum()
    return float(above / both) if both > 0 else 0.5


def _transform_field(
    field: GaussianField, rotation: Float[Array, "3 3"], scale: float, shift: Float[Array, "3"]
) -> GaussianField:
    """The field in another world frame: p becomes scale * rotation @ p + shift. Colours of degree 0 do not turn."""
    means = scale * field.means.astype(float) @ rotation.T + shift
    # Rotation composes in x y z w and normalises; a length that float32 cannot square must not overflow on the way.
    quats = field.quats / np.abs(field.quats).max(1, keepdims=True)
    turned = (Rotation.from_matrix(rotation) * Rotation.from_quat(quats[:, [1, 2, 3, 0]])).as_quat()
    return replace(
        field,
        means=means.astype(np.float32),
        log_scales=(field.log_scales + np.log(scale)).astype(np.float32),
        quats=np.ascontiguousarray(turned[:, [3, 0, 1, 2]], np.float32),
    )


def _find_surface(field: GaussianField) -> Bool[Array, "n"]:
    """Which Gaussians are opaque, or of a field of faint ones the most opaque."""
    opacities = expit(field.opacity_logits)
    return opacities >= (np.clip(np.percentile(opacities, SURFACE), FAINTEST, OPAQUE) if len(field) else OPAQUE)


def _project_discs(field: GaussianField) -> tuple[Float[Array, "m 2"], Float[Array, "m"]]:
    """Where the opaque Gaussians are over the ground, and the geometric means of their two larger deviations."""
    opaque = _find_surface(field)
    larger = np.sort(field.log_scales[opaque].astype(float), axis=1)[:, 1:]
    return field.means[opaque, :2].astype(float), np.exp(larger.mean(1))


def _opaque_ground(
    places: Float[Array, "m 2"], widths: Float[Array, "m"], cells: int
) -> tuple[Bool[Array, "rows columns"], float, float, float]:
    """A map of where opaque Gaussians cover the ground, from south to north; its west, south and cell.

    A Gaussian covers a circle of DISC times its width. Gaps of up to four cells between discs (1.6 % of the scene) are
    closed.
    """
    low, high = np.percentile(places, ROBUST, axis=0)
    cell = float((high - low).max() / cells)
    columns, rows = np.maximum(1, np.ceil((high - low) / cell - 1e-9).astype(int))
    column, row = np.floor((places - low) / cell).astype(int).T
    inside = (column >= 0) & (column < columns) & (row >= 0) & (row < rows)
    radius = np.clip(DISC * widths / cell, 0, WIDEST_DISC).astype(int)
    mask = np.zeros((rows, columns), bool)
    for r in range(WIDEST_DISC + 1):
        own = inside & (radius == r)
        if own.any():
            empty = np.ones((rows, columns), bool)
            empty[row[own], column[own]] = False
            mask |= distance_transform_edt(empty) <= r
    padded = binary_closing(np.pad(mask, 3), np.ones((3, 3), bool), iterations=2)
    return padded[3:-3, 3:-3], float(low[0]), float(low[1]), cell
