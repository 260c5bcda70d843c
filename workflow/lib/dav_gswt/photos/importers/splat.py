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
from dav_gswt.geometry.scene_frame import SceneFrame, Square
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
OPAQUE = 0.5  # peak opacity from which a Gaussian counts as surface
LEAST = 100  # opaque Gaussians, below which there is nothing to find a ground in
ROBUST = (1, 99)  # percentiles of the opaque Gaussians' positions between which the scene lies
MARGIN = 0.2  # kept around it, as a share of its size; what is farther off is a floater, a sky or a far background
LARGEST = 0.5  # standard deviation of a Gaussian, as a share of the scene's size; larger ones are haze
ROUGHEST = 0.1  # spread of the surface about its plane, as a share of the scene's size; above it there is no ground
VIEW = 60.0  # degrees across the virtual camera's picture that the exemplar fills: it gives the flying height
CELLS, COARSE_CELLS = 256, 128  # of the map of opaque ground along its longer side; while directions are tried
DISC = 2.0  # standard deviations of a disc that count as covered ground
WIDEST_DISC = 6  # cells, the most that a single Gaussian covers


def fit_field_frame(
    field: GaussianField, rng: np.random.Generator, up: Sequence = UP
) -> tuple[GaussianField, SceneFrame]:
    """The field in its ground frame, and this frame.

    z points from the robust plane through the opaque Gaussians to the side of `up`, three numbers of any length; x and
    y run so that the exemplar, the largest square of opaque ground, is as large as can be; the origin is its middle. No
    camera is known, so the flying height, which is the unit, is a virtual one: from there a picture of VIEW degrees
    shows just the exemplar.
    Only the colour that is the same from all sides is kept (degree 0).
    Raises: InputError: too few opaque Gaussians, or no ground across `up`.
    """
    before, degree = len(field), field.sh_degree
    if degree > 0:
        _log.warning("view-dependent colour (degree %d) is dropped: the colour from all sides is kept", degree)
        field = replace(field, sh=np.ascontiguousarray(field.sh[:, :1]))
    field = field[_select_near(field)]
    field, relief = _level_field(field, np.array(up, float), rng)
    field, side, height = _center_on_exemplar(field)
    extent = find_extent(*_opaque_ground(*_project_discs(field), CELLS))
    side, relief = float(side / height), float(relief / height)
    frame = SceneFrame(
        kind="field",
        unit="flying height",
        flying_height=1.0,
        exemplar=Square(-side / 2, -side / 2, side),
        extent=extent,
        relief=relief,
        gaussians=len(field),
        removed=before - len(field),
    )
    _log.info("%d of %d Gaussians are kept; relief %.3f flying heights", len(field), before, relief)
    return field, frame


def _center_on_exemplar(field: GaussianField) -> tuple[GaussianField, float, float]:
    """A level field turned so that its exemplar is largest, with that square's middle as origin and the flying height
    as unit; the square's side and the flying height in the old unit."""
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
    return _transform_field(field, turn, 1 / height, -middle / height), side, height


def _select_near(field: GaussianField) -> Bool[Array, "n"]:
    """Gaussians within the scene: not far outside the box that holds nearly all opaque ones, and not as large as it."""
    opaque = expit(field.opacity_logits) >= OPAQUE
    if opaque.sum() < LEAST:
        raise InputError(f"the field has {opaque.sum()} opaque Gaussians; a surface of at least {LEAST} is needed")
    low, high = np.percentile(field.means[opaque], ROBUST, axis=0)
    size = float((high - low).max())
    inside = (field.means >= low - MARGIN * size) & (field.means <= high + MARGIN * size)
    return inside.all(1) & (field.log_scales.max(1) <= np.log(LARGEST * size))


def _level_field(field: GaussianField, up: Float[Array, "3"], rng: np.random.Generator) -> tuple[GaussianField, float]:
    """The field with z up and its plane at 0; and its surface's spread about the plane."""
    surface = field.means[expit(field.opacity_logits) >= OPAQUE].astype(float)
    size = float(np.ptp(np.percentile(surface, ROBUST, axis=0), axis=0).max())
    normal, offset, spread = fit_plane(surface, rng, up)
    if spread > ROUGHEST * size:
        raise InputError(
            "the field has no ground across the direction `up`; give the direction that points up in the file "
            "(config: scenes, up), for instance [0, 0, 1]"
        )
    axes = np.eye(3)
    east = axes[0] if abs(normal[0]) < 0.9 else axes[1]
    return _transform_field(field, make_upright_rotation(normal, east), 1.0, np.array([0.0, 0.0, -offset])), spread


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


def _project_discs(field: GaussianField) -> tuple[Float[Array, "m 2"], Float[Array, "m"]]:
    """Where the opaque Gaussians are over the ground, and the geometric means of their two larger deviations."""
    opaque = expit(field.opacity_logits) >= OPAQUE
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
