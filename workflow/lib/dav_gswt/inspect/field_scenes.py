"""Scenes of Gaussian fields, one or several levels of detail, by colour, uncertainty or level."""

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
from dav_gswt.inspect import result_files
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

MIN_OPACITY = 0.1  # peak opacity below which a Gaussian is left out: solids would hide what lies behind it
FLAT_RATIO = 0.35  # of a Gaussian's middle axis, below which its least axis is not drawn
OUTLIERS = 0.002  # of all Gaussians, on each side, outside the first view at most
SHADE = 1.5  # of a colour's strength, per brightness
GAP = 0.2  # between two fields of a row, in widths of a field
LEVEL_COLOURS = [(68, 119, 170), (238, 102, 119), (34, 136, 51), (204, 187, 68), (102, 204, 238), (170, 51, 119)]
HEXAGON = np.stack([np.cos(np.arange(6) * np.pi / 3), np.sin(np.arange(6) * np.pi / 3), np.zeros(6)], -1)
HEXAGON_AREA, OCTAHEDRON_VOLUME = 1.5 * 3**0.5, 4 / 3
OCTAHEDRON = np.concatenate([np.eye(3), -np.eye(3)])
SIDES = np.array([[0, 1, 2], [1, 3, 2], [3, 4, 2], [4, 0, 2], [1, 0, 5], [3, 1, 5], [4, 3, 5], [0, 4, 5]])
COLOUR_NAMES = ("colour", "uncertainty", "level")


def build_field(path: Path, options: ViewOptions) -> Scene:
    """A field of a .ply file."""
    field = read_field(path)
    number = re.match(r"(?:level|lod)(\d+)", path.stem)
    if options.colour == "level" and number is None:
        raise InputError(f"{path}: no level by its name; give levels/ or a folder of tiles to see levels")
    return arrange_fields(str(path), [field], [int(number[1]) if number else 0], options)


def build_uncertain_field(path: Path, options: ViewOptions) -> Scene:
    """A field by the uncertainty that maps.npz gives its Gaussians."""
    file = result_files.find_above(path, "field.ply", folders=2)
    if file is None:
        raise InputError(f"{path}: there is no field.ply beside it, whose Gaussians it describes")
    field, uncertainty = read_field(file), pose_maps.read_pose_maps(path)[1]
    if uncertainty.ndim != 1 or len(uncertainty) > len(field) or not np.isfinite(uncertainty).all():
        raise InputError(f"{path}: describes other Gaussians than those of {file}; score the poses again")
    options = replace(options, colour=options.colour or "uncertainty")
    field = pose_maps.apply_uncertainty(field, uncertainty.astype(np.float32))
    return arrange_fields(str(path), [field], [0], options)


def build_levels_scene(path: Path, options: ViewOptions) -> Scene:
    """A folder of levels: all side by side, the finest in the west, or the one options for."""
    fields = store.read_levels(path).fields
    numbers = options.choose_levels(len(fields), path)
    return arrange_fields(str(path), [fields[i] for i in numbers], numbers, options)


def arrange_fields(title: str, fields: list[GaussianField], numbers: list[int], options: ViewOptions) -> Scene:
    """Fields side by side, in their order. numbers: their levels."""
    colour = options.choose_colour(COLOUR_NAMES, title)
    layers, lows, highs, counts, east = [], [], [], [], 0.0
    for field, number in zip(fields, numbers, strict=True):
        kept = thin_field(field, options.most // len(fields))
        counts.append((len(kept), len(field)))
        if not len(kept):
            raise InputError(
                f"{title}: no Gaussian in it is more opaque than {MIN_OPACITY:g}; there is nothing to draw"
            )
        low, high = np.quantile(kept.means, [OUTLIERS, 1 - OUTLIERS], axis=0)
        by = np.array([east - low[0] if lows else 0.0, 0.0, 0.0])
        layers += [move_layer(layer, by) for layer in make_solids(kept, compute_colours(kept, colour, number))]
        lows.append(low + by)
        highs.append(high + by)
        east = highs[-1][0] + GAP * (high - low)[0]
    legend = make_legend(colour, numbers)
    about = [f"{kept} of {all_} Gaussians, by {colour}" for kept, all_ in counts]
    about = [f"level {n}: {text}" for n, text in zip(numbers, about, strict=True)] if len(fields) > 1 else about
    return Scene(title, layers, np.min(lows, 0), np.max(highs, 0), about, legend=legend)


def make_legend(colour: str, levels: list[int]) -> list[ColourBar | ColourKey]:
    """The legend of fields coloured by one of COLOUR_NAMES."""
    if colour == "uncertainty":
        return [ColourBar("uncertainty", 0.0, 1.0)]
    return [ColourKey({f"level {n}": level_colour(n) for n in levels})] if colour == "level" else []


def thin_field(field: GaussianField, most: int) -> GaussianField:
    """At most `most` of the Gaussians that are opaque enough to be visible, evenly by their order in the file, enlarged
    so that they cover as much."""
    visible = field[expit(field.opacity_logits) >= MIN_OPACITY]
    if len(visible) <= most:
        return visible
    kept = visible[np.linspace(0, len(visible) - 1, max(1, most)).astype(int)]
    return replace(kept, log_scales=kept.log_scales + np.float32(0.5 * np.log(len(visible) / len(kept))))


def level_colour(number: int) -> tuple[int, int, int]:
    return LEVEL_COLOURS[number % len(LEVEL_COLOURS)]


def compute_colours(field: GaussianField, by: str, level: int = 0) -> UInt8[Array, "n 3"]:
    """A colour for each Gaussian. by: one of COLOUR_NAMES."""
    if by == "uncertainty":
        return map_colours(field.uncertainty, ColourBar("", 0.0, 1.0, UNCERTAINTY_MAP))
    if by == "level":
        return shade_colours(np.array([level_colour(level)]), field)
    return to_bytes(field.base_colours)


def shade_colours(named: Int[Array, "#n 3"], field: GaussianField) -> UInt8[Array, "n 3"]:
    """Colours of a legend, lighter and darker by each Gaussian's own brightness, so that shapes are visible."""
    grey = np.clip(field.base_colours, 0, 1).mean(1)
    light = 1 + SHADE * (grey - np.median(grey))
    return to_bytes(named / 255 * light[:, None])


def make_solids(field: GaussianField, colours: UInt8[Array, "n 3"]) -> list[Layer]:
    """Gaussians at one standard deviation: a hexagon of the ellipse's area for a flat one, else an octahedron of the
    ellipsoid's volume."""
    scales = np.exp(field.log_scales.astype(float))
    order = np.argsort(-scales, axis=1, kind="stable")
    scales = np.take_along_axis(scales, order, 1)
    rotations = Rotation.from_quat(field.quats[:, [1, 2, 3, 0]].astype(float)).as_matrix()
    axes = np.take_along_axis(rotations, order[:, None], 2) * scales[:, None]  # columns are the axes, longest first
    flat = field.ground | (scales[:, 2] < FLAT_RATIO * scales[:, 1])
    size = np.pi / HEXAGON_AREA, 4 / 3 * np.pi / OCTAHEDRON_VOLUME
    discs = _place_shape(field.means[flat], axes[flat], HEXAGON * size[0] ** 0.5)
    round_ = _place_shape(field.means[~flat], axes[~flat], OCTAHEDRON * size[1] ** (1 / 3))
    layers = [copy_shape(discs, np.arange(6)[None], colours[flat]), copy_shape(round_, SIDES, colours[~flat])]
    return [layer for layer in layers if len(layer.points)]


def _place_shape(
    means: Float[Array, "n 3"], axes: Float[Array, "n 3 3"], shape: Float[Array, "v 3"]
) -> Float[Array, "n v 3"]:
    return means[:, None].astype(float) + np.einsum("nij,vj->nvi", axes, shape)
