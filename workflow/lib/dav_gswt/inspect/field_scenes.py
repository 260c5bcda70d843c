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
from dav_gswt.inspect.options import ViewOptions
from dav_gswt.inspect.scene import (
    UNCERTAINTY_MAP,
    ColourBar,
    ColourKey,
    Layer,
    Scene,
    copy_shape,
    map_colours,
    move_layer,
    to_bytes,
)
from dav_gswt.lod import store
from dav_gswt.views import pose_maps

MIN_OPACITY = 0.1  # peak opacity below which a Gaussian is left out: it hides what it would hardly tint
FLAT_RATIO = 0.35  # of a Gaussian's middle axis, below which its least one is not shown
OUTLIERS = 0.002  # of all Gaussians, on each side, that the first view may leave out
SHADE = 1.5  # of a colour's strength, per brightness
GAP = 0.2  # widths of a field, between two of a row
LEVEL_COLOURS = [(68, 119, 170), (238, 102, 119), (34, 136, 51), (204, 187, 68), (102, 204, 238), (170, 51, 119)]
HEXAGON = np.stack([np.cos(np.arange(6) * np.pi / 3), np.sin(np.arange(6) * np.pi / 3), np.zeros(6)], -1)
HEXAGON_AREA, OCTAHEDRON_VOLUME = 1.5 * 3**0.5, 4 / 3
OCTAHEDRON = np.concatenate([np.eye(3), -np.eye(3)])
SIDES = np.array([[0, 1, 2], [1, 3, 2], [3, 4, 2], [4, 0, 2], [1, 0, 5], [3, 1, 5], [4, 3, 5], [0, 4, 5]])
COLOUR_NAMES = ("colour", "uncertainty", "level")


def build_field(path: Path, asked: ViewOptions) -> Scene:
    """A field of a .ply file."""
    found = read_field(path)
    number = re.match(r"(?:level|lod)(\d+)", path.stem)
    if asked.colour == "level" and number is None:
        raise InputError(f"{path}: no level by its name; give levels/ or a folder of tiles to see levels")
    return arrange_fields(str(path), [found], [int(number[1]) if number else 0], asked)


def build_uncertain_field(path: Path, asked: ViewOptions) -> Scene:
    """A field by the uncertainty that maps.npz gives its Gaussians."""
    beside = next((f for f in (path.parent / "field.ply", path.parent.parent / "field.ply") if f.is_file()), None)
    if beside is None:
        raise InputError(f"{path}: there is no field.ply beside it; it tells of the Gaussians of one")
    found, doubt = read_field(beside), pose_maps.read_pose_maps(path)[1]
    if doubt.ndim != 1 or len(doubt) > len(found) or not np.isfinite(doubt).all():
        raise InputError(f"{path}: tells of other Gaussians than those of {beside}; score the poses again")
    asked = replace(asked, colour=asked.colour or "uncertainty")
    return arrange_fields(str(path), [pose_maps.apply_uncertainty(found, doubt.astype(np.float32))], [0], asked)


def build_levels_scene(path: Path, asked: ViewOptions) -> Scene:
    """A folder of levels: all side by side, the finest in the west, or the one asked for."""
    found = store.read_levels(path).fields
    numbers = asked.choose_levels(len(found), path)
    return arrange_fields(str(path), [found[i] for i in numbers], numbers, asked)


def arrange_fields(title: str, found: list[GaussianField], numbers: list[int], asked: ViewOptions) -> Scene:
    """Fields side by side, in their order. numbers: their levels."""
    colour = asked.choose_colour(COLOUR_NAMES, title)
    layers, lows, highs, counts, east = [], [], [], [], 0.0
    for one, number in zip(found, numbers, strict=True):
        kept = thin_field(one, asked.most // len(found))
        counts.append((len(kept), len(one)))
        if not len(kept):
            raise InputError(f"{title}: no Gaussian in it is more opaque than {MIN_OPACITY:g}; nothing is to be seen")
        low, high = np.quantile(kept.means, [OUTLIERS, 1 - OUTLIERS], axis=0)
        by = np.array([east - low[0] if lows else 0.0, 0.0, 0.0])
        layers += [move_layer(layer, by) for layer in make_solids(kept, compute_colours(kept, colour, number))]
        lows.append(low + by)
        highs.append(high + by)
        east = highs[-1][0] + GAP * (high - low)[0]
    legend = [ColourBar("uncertainty", 0.0, 1.0)] * (colour == "uncertainty")
    legend += [ColourKey({f"level {n}": level_colour(n) for n in numbers})] * (colour == "level")
    about = [f"{kept} of {all_} Gaussians, by {colour}" for kept, all_ in counts]
    about = [f"level {n}: {text}" for n, text in zip(numbers, about, strict=True)] if len(found) > 1 else about
    return Scene(title, layers, np.min(lows, 0), np.max(highs, 0), about, legend=legend)


def thin_field(whole: GaussianField, most: int) -> GaussianField:
    """What is opaque enough to be seen, and of that at most so many, evenly by their order in the file; these are then
    so much larger that they cover as much."""
    seen = whole[expit(whole.opacity_logits) >= MIN_OPACITY]
    if len(seen) <= most:
        return seen
    kept = seen[np.linspace(0, len(seen) - 1, max(1, most)).astype(int)]
    return replace(kept, log_scales=kept.log_scales + np.float32(0.5 * np.log(len(seen) / len(kept))))


def level_colour(number: int) -> tuple[int, int, int]:
    return LEVEL_COLOURS[number % len(LEVEL_COLOURS)]


def compute_colours(some: GaussianField, by: str, level: int = 0) -> UInt8[Array, "n 3"]:
    """A colour a Gaussian. by: one of NAMES."""
    if by == "uncertainty":
        return map_colours(some.uncertainty, ColourBar("", 0.0, 1.0, UNCERTAINTY_MAP))
    if by == "level":
        return shade_colours(np.array([level_colour(level)]), some)
    return to_bytes(some.base_colours)


def shade_colours(named: Int[Array, "#n 3"], some: GaussianField) -> UInt8[Array, "n 3"]:
    """Colours of names, as bytes, brighter and darker by each Gaussian's own, so that shapes can be seen."""
    grey = np.clip(some.base_colours, 0, 1).mean(1)
    light = 1 + SHADE * (grey - np.median(grey))
    return to_bytes(named / 255 * light[:, None])


def make_solids(some: GaussianField, tint: UInt8[Array, "n 3"]) -> list[Layer]:
    """Gaussians at one standard deviation: a hexagon of the ellipse's area for a flat one, else an octahedron of the
    ellipsoid's volume."""
    scales = np.exp(some.log_scales.astype(float))
    order = np.argsort(-scales, axis=1, kind="stable")
    scales = np.take_along_axis(scales, order, 1)
    turns = Rotation.from_quat(some.quats[:, [1, 2, 3, 0]].astype(float)).as_matrix()
    axes = np.take_along_axis(turns, order[:, None], 2) * scales[:, None]  # columns are the axes, longest first
    flat = some.ground | (scales[:, 2] < FLAT_RATIO * scales[:, 1])
    size = np.pi / HEXAGON_AREA, 4 / 3 * np.pi / OCTAHEDRON_VOLUME
    discs = _place_shape(some.means[flat], axes[flat], HEXAGON * size[0] ** 0.5)
    round_ = _place_shape(some.means[~flat], axes[~flat], OCTAHEDRON * size[1] ** (1 / 3))
    found = [copy_shape(discs, np.arange(6)[None], tint[flat]), copy_shape(round_, SIDES, tint[~flat])]
    return [layer for layer in found if len(layer.points)]


def _place_shape(
    means: Float[Array, "n 3"], axes: Float[Array, "n 3 3"], shape: Float[Array, "v 3"]
) -> Float[Array, "n v 3"]:
    return means[:, None].astype(float) + np.einsum("nij,vj->nvi", axes, shape)
