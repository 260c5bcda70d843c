"""Fields of Gaussians, one or a ladder of levels, by colour, uncertainty or level."""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
from jaxtyping import Float, Int, UInt8
from numpy import ndarray as Array
from scipy.spatial.transform import Rotation
from scipy.special import expit

from dav_gswt.errors import InputError
from dav_gswt.field import GaussianField, read_field
from dav_gswt.inspect.options import Asked
from dav_gswt.inspect.scene import DOUBT, Bar, Keys, Layer, Scene, bytes_of, coloured, copies, moved
from dav_gswt.lod import store
from dav_gswt.views import pose_maps

FAINT = 0.1  # peak opacity below which a Gaussian is left out: it hides what it would hardly tint
FLAT = 0.35  # of a Gaussian's middle axis, below which its least one is not shown
FAR = 0.002  # of all Gaussians, on each side, that the first view may leave out
SHADE = 1.5  # of a colour's strength, per brightness
APART = 0.2  # widths of a field, between two of a row
LEVELS = [(68, 119, 170), (238, 102, 119), (34, 136, 51), (204, 187, 68), (102, 204, 238), (170, 51, 119)]
HEXAGON = np.stack([np.cos(np.arange(6) * np.pi / 3), np.sin(np.arange(6) * np.pi / 3), np.zeros(6)], -1)
HEXAGON_AREA, OCTAHEDRON_VOLUME = 1.5 * 3**0.5, 4 / 3
OCTAHEDRON = np.concatenate([np.eye(3), -np.eye(3)])
SIDES = np.array([[0, 1, 2], [1, 3, 2], [3, 4, 2], [4, 0, 2], [1, 0, 5], [3, 1, 5], [4, 3, 5], [0, 4, 5]])
NAMES = ("colour", "uncertainty", "level")


def show(path: Path, asked: Asked) -> Scene:
    """A field of a .ply file."""
    found = read_field(path)
    number = re.match(r"(?:level|lod)(\d+)", path.stem)
    if asked.colour == "level" and number is None:
        raise InputError(f"{path}: no level by its name; give levels/ or a folder of tiles to see levels")
    return of_fields(str(path), [found], [int(number[1]) if number else 0], asked)


def show_doubted(path: Path, asked: Asked) -> Scene:
    """A field by the uncertainty that maps.npz gives its Gaussians."""
    beside = next((f for f in (path.parent / "field.ply", path.parent.parent / "field.ply") if f.is_file()), None)
    if beside is None:
        raise InputError(f"{path}: there is no field.ply beside it; it tells of the Gaussians of one")
    found, doubt = read_field(beside), pose_maps.read_pose_maps(path)[1]
    if doubt.ndim != 1 or len(doubt) > len(found) or not np.isfinite(doubt).all():
        raise InputError(f"{path}: tells of other Gaussians than those of {beside}; score the poses again")
    asked = replace(asked, colour=asked.colour or "uncertainty")
    return of_fields(str(path), [pose_maps.apply_uncertainty(found, doubt.astype(np.float32))], [0], asked)


def show_levels(path: Path, asked: Asked) -> Scene:
    """A folder of levels: all side by side, the finest in the west, or the one asked for."""
    found = store.read(path).fields
    numbers = asked.levels_of(len(found), path)
    return of_fields(str(path), [found[i] for i in numbers], numbers, asked)


def of_fields(title: str, found: list[GaussianField], numbers: list[int], asked: Asked) -> Scene:
    """Fields side by side, in their order. numbers: their levels."""
    colour = asked.one_of(NAMES, title)
    layers, lows, highs, counts, east = [], [], [], [], 0.0
    for one, number in zip(found, numbers, strict=True):
        kept = thinned(one, asked.most // len(found))
        counts.append((len(kept), len(one)))
        if not len(kept):
            raise InputError(f"{title}: no Gaussian in it is more opaque than {FAINT:g}; nothing is to be seen")
        low, high = np.quantile(kept.means, [FAR, 1 - FAR], axis=0)
        by = np.array([east - low[0] if lows else 0.0, 0.0, 0.0])
        layers += [moved(layer, by) for layer in solid(kept, colours(kept, colour, number))]
        lows.append(low + by)
        highs.append(high + by)
        east = highs[-1][0] + APART * (high - low)[0]
    legend = [Bar("uncertainty", 0.0, 1.0)] * (colour == "uncertainty")
    legend += [Keys({f"level {n}": level_colour(n) for n in numbers})] * (colour == "level")
    about = [f"{kept} of {all_} Gaussians, by {colour}" for kept, all_ in counts]
    about = [f"level {n}: {text}" for n, text in zip(numbers, about, strict=True)] if len(found) > 1 else about
    return Scene(title, layers, np.min(lows, 0), np.max(highs, 0), about, legend=legend)


def thinned(whole: GaussianField, most: int) -> GaussianField:
    """What is opaque enough to be seen, and of that at most so many, evenly by their order in the file; these are then
    so much larger that they cover as much."""
    seen = whole[expit(whole.opacity_logits) >= FAINT]
    if len(seen) <= most:
        return seen
    kept = seen[np.linspace(0, len(seen) - 1, max(1, most)).astype(int)]
    return replace(kept, log_scales=kept.log_scales + np.float32(0.5 * np.log(len(seen) / len(kept))))


def level_colour(number: int) -> tuple[int, int, int]:
    return LEVELS[number % len(LEVELS)]


def colours(some: GaussianField, by: str, level: int = 0) -> UInt8[Array, "n 3"]:
    """A colour a Gaussian. by: one of NAMES."""
    if by == "uncertainty":
        return coloured(some.uncertainty, Bar("", 0.0, 1.0, DOUBT))
    if by == "level":
        return shaded(np.array([level_colour(level)]), some)
    return bytes_of(some.base_colours)


def shaded(named: Int[Array, "#n 3"], some: GaussianField) -> UInt8[Array, "n 3"]:
    """Colours of names, as bytes, brighter and darker by each Gaussian's own, so that shapes can be seen."""
    grey = np.clip(some.base_colours, 0, 1).mean(1)
    light = 1 + SHADE * (grey - np.median(grey))
    return bytes_of(named / 255 * light[:, None])


def solid(some: GaussianField, tint: UInt8[Array, "n 3"]) -> list[Layer]:
    """Gaussians at one standard deviation: a hexagon of the ellipse's area for a flat one, else an octahedron of the
    ellipsoid's volume."""
    scales = np.exp(some.log_scales.astype(float))
    order = np.argsort(-scales, axis=1, kind="stable")
    scales = np.take_along_axis(scales, order, 1)
    turns = Rotation.from_quat(some.quats[:, [1, 2, 3, 0]].astype(float)).as_matrix()
    axes = np.take_along_axis(turns, order[:, None], 2) * scales[:, None]  # columns are the axes, longest first
    flat = some.ground | (scales[:, 2] < FLAT * scales[:, 1])
    size = np.pi / HEXAGON_AREA, 4 / 3 * np.pi / OCTAHEDRON_VOLUME
    discs = _placed(some.means[flat], axes[flat], HEXAGON * size[0] ** 0.5)
    round_ = _placed(some.means[~flat], axes[~flat], OCTAHEDRON * size[1] ** (1 / 3))
    found = [copies(discs, np.arange(6)[None], tint[flat]), copies(round_, SIDES, tint[~flat])]
    return [layer for layer in found if len(layer.points)]


def _placed(
    means: Float[Array, "n 3"], axes: Float[Array, "n 3 3"], shape: Float[Array, "v 3"]
) -> Float[Array, "n v 3"]:
    return means[:, None].astype(float) + np.einsum("nij,vj->nvi", axes, shape)
