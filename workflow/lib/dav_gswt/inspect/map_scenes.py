"""Scenes of float maps: every channel as a picture, or one as the colours of the ground's surface."""

from math import ceil
from pathlib import Path

import numpy as np
from jaxtyping import Float, Float32
from numpy import ndarray as Array

from dav_gswt.errors import InputError
from dav_gswt.images import image_files
from dav_gswt.inspect import field_scenes, result_files
from dav_gswt.inspect.options import ViewOptions
from dav_gswt.inspect.scene import UNCERTAINTY_MAP, ColourBar, Label, Layer, Scene, make_bar, make_picture, map_colours
from dav_gswt.reconstruction import ground
from dav_gswt.reconstruction.ground import Ground
from dav_gswt.views import pose_maps as posed
from dav_gswt.views.policies import HIGHEST
from dav_gswt.views.pose_maps import Part

ASPECT = 1.6  # of all pictures side by side, over their height
MAX_PICTURES = 60
MAX_SIDE = 1024  # pixels of a picture's longer side
ROOM, LETTER = 0.12, 0.05  # space between pictures and height of letters, in picture widths
HEIGHTS = "viridis"
UNCERTAINTY_CHANNELS = ("opacity", "w2_sq", "uncertainty")  # drawn with UNCERTAINTY_MAP
ABOVE = "above"  # the part of uncertainty.exr that lies over the ground


def build_map(path: Path, options: ViewOptions) -> Scene:
    """An EXR file: a ground grid, or the part `above` if selected, as a surface; anything else as pictures."""
    parts = image_files.read_exr_parts(path)
    if len(parts) == 1 and "ground_west" in (only := next(iter(parts.values())))[1]:
        return _build_surface(path, ground.read_ground(path), only[0], options)
    if options.part == ABOVE and ABOVE in parts:
        return _build_surface(path, _find_grid(path), parts[ABOVE][0], options)
    return arrange_pictures(path, _select_channels(parts, options, path), options)


def build_materials(folder: Path, options: ViewOptions) -> Scene:
    """A folder of materials: which material, object and excluded ground each cell of the exemplar belongs to."""
    return build_map(folder / "materials.exr", options)


def build_pose_maps(path: Path, options: ViewOptions) -> Scene:
    """maps.npz: the field by the uncertainty that its maps gave it; with --part or --channel the maps themselves."""
    if options.part is None and options.channel is None:
        return field_scenes.build_uncertain_field(path, options)
    options.reject_others(path, "part", "channel")
    maps, _ = posed.read_pose_maps(path)
    with result_files.wrap_errors(path):
        parts = {}
        for i, name in enumerate(maps.names):
            channels = {"opacity": maps.opacity[i]} | ({} if maps.w2_sq is None else {"w2_sq": maps.w2_sq[i]})
            if any(values.ndim != 2 for values in channels.values()):
                raise ValueError(f"the maps of {name} are no pictures")
            parts[name] = (channels, {})
    return arrange_pictures(path, _select_channels(parts, options, path), options)


def _select_channels(parts: dict[str, Part], options: ViewOptions, path: Path) -> dict[str, dict[str, Array]]:
    """The selected channels, by part. Raises: InputError: no such part or channel."""
    if options.part is not None and options.part not in parts:
        raise InputError(f"--part {options.part}: {path} has {_list_some([n or 'one without a name' for n in parts])}")
    names = [options.part] if options.part is not None else list(parts)
    selected = {
        name: {k: v for k, v in parts[name][0].items() if options.channel in (None, k) and v.ndim == 2}
        for name in names
    }
    if not any(selected.values()):
        known = sorted({k for name in names for k in parts[name][0]})
        raise InputError(f"--channel {options.channel}: {path} has {_list_some(known)}")
    return selected


def _list_some(names: list[str]) -> str:
    return ", ".join(names[:20]) + (f" and {len(names) - 20} more" if len(names) > 20 else "")


def arrange_pictures(path: Path, parts: dict[str, dict[str, Array]], options: ViewOptions) -> Scene:
    """Each channel of each part, in rows from the top left; one scale a channel."""
    shown = [(part, channel, values) for part, channels in parts.items() for channel, values in channels.items()]
    left_out, shown = max(0, len(shown) - MAX_PICTURES), shown[:MAX_PICTURES]
    names = dict.fromkeys(channel for _, channel, _ in shown)
    bars = {
        name: make_bar(name, np.concatenate([v.ravel() for _, c, v in shown if c == name]), _colour_map(name), HIGHEST)
        for name in names
    }
    aspect = max(v.shape[0] / v.shape[1] for _, _, v in shown)
    columns = min(len(shown), ceil((len(shown) * ASPECT * aspect) ** 0.5))
    step = np.array([1 + ROOM, aspect + ROOM + LETTER])
    layers, labels = [], []
    for i, (part, channel, values) in enumerate(shown):
        x, y = (i % columns) * step[0], -(i // columns) * step[1]
        height = values.shape[0] / values.shape[1]
        picture = map_colours(subsample(values), bars[channel])
        layers.append(make_picture(picture, np.array([x, y, 0.0]), np.array([1.0, 0, 0]), np.array([0, -height, 0.0])))
        labels.append(Label(f"{part} {channel}".strip(), (x + 0.5, y - height - 0.05, 0.0), LETTER, upright=False))
    rows = ceil(len(shown) / columns)
    low, high = np.array([0.0, -rows * step[1], 0.0]), np.array([columns * step[0] - ROOM, 0.0, 0.0])
    holes = any(not np.isfinite(values).all() for _, _, values in shown)
    notes = [f"parts: {len(parts)}; pictures: {len(shown)}{'; grey: not a number' * holes}"]
    if left_out:
        notes.append(f"{left_out} more pictures: pick by --part or --channel")
    return Scene(str(path), layers, low, high, notes, labels, list(bars.values()), (0.0, 0.0, 1.0), flat=True)


def subsample(values: Float32[Array, "h w"]) -> Float32[Array, "h2 w2"]:
    """Every n-th pixel of a map, so that it has at most MAX_SIDE pixels a side."""
    step = ceil(max(values.shape) / MAX_SIDE)
    return values[::step, ::step]


def _colour_map(channel: str) -> str:
    return UNCERTAINTY_MAP if channel in UNCERTAINTY_CHANNELS else HEIGHTS


def _find_grid(path: Path) -> Ground:
    """The ground of the field that the maps are of."""
    file = result_files.find_above(path, "ground.exr", folders=2)
    if file is None:
        raise InputError(f"{path}: there is no ground.exr beside it, which its part {ABOVE} is drawn on")
    return ground.read_ground(file)


def _build_surface(path: Path, grid: Ground, channels: dict[str, Array], options: ViewOptions) -> Scene:
    """The ground's surface, coloured by a channel; rows of a channel run from the north, as in the file."""
    name = options.channel or next((n for n in ("Z", "uncertainty") if n in channels), next(iter(channels)))
    if name not in channels:
        raise InputError(f"--channel {name}: {path} has {_list_some(sorted(channels))}")
    values = channels[name]
    if values.shape != grid.shape:
        raise InputError(f"{path}: is of {values.shape} cells and the ground beside it of {grid.shape}; score again")
    bar = ColourBar(name, 0.0, 1.0) if name in ("uncertainty", "seen") else make_bar(name, values, _colour_map(name))
    layer = make_surface(grid, values[::-1].astype(float), bar, options.most)
    rows, columns = grid.shape
    about = f"{columns} x {rows} cells of {grid.spacing:.4g}; surface by {name}"
    return Scene(str(path), [layer], layer.points.min(0), layer.points.max(0), [about], legend=[bar])


def make_surface(grid: Ground, values: Float[Array, "rows columns"], bar: ColourBar, most: int) -> Layer:
    """A quad a cell, through heights averaged at the cells' corners; subsampled to about `most` cells."""
    step = ceil((values.size / most) ** 0.5) if values.size > most else 1
    heights, values, spacing = grid.heights[::step, ::step], values[::step, ::step], grid.spacing * step
    rows, columns = values.shape
    padded = np.pad(heights, 1, mode="edge")
    z = (padded[:-1, :-1] + padded[1:, :-1] + padded[:-1, 1:] + padded[1:, 1:]) / 4
    x, y = np.meshgrid(grid.west + np.arange(columns + 1) * spacing, grid.south + np.arange(rows + 1) * spacing)
    points = np.stack([x.ravel(), y.ravel(), np.nan_to_num(z.ravel())], 1).astype(np.float32)
    first = (np.arange(rows)[:, None] * (columns + 1) + np.arange(columns)).ravel()
    cells = first[:, None] + np.array([0, 1, columns + 2, columns + 1])
    return Layer("faces", points, cells, map_colours(values.ravel(), bar))
