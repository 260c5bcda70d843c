"""Readers of float maps: channels as pictures, or one channel as the colours of the ground's surface."""

from math import ceil
from pathlib import Path

import numpy as np
from numpy import ndarray as Array

from dav_gswt.errors import InputError
from dav_gswt.field import read_field
from dav_gswt.images import image_files
from dav_gswt.inspect.plot import UNCERTAINTY_MAP, Bar, Scene
from dav_gswt.inspect.readers import arrange_fields, choose, find_above, make_surface, reader, wrap_errors
from dav_gswt.reconstruction.ground import Ground, read_ground
from dav_gswt.views import pose_maps
from dav_gswt.views.score_colours import HIGHEST

ASPECT, LETTER = 1.6, 0.05  # of all pictures side by side, width over height; height of letters, in picture widths
MAX_PICTURES, MAX_SIDE = 60, 1024  # pictures of a scene, and pixels of a picture's longer side


@reader("materials.json")
def read_materials(path: Path, *, most: int, part: str | None = None, channel: str | None = None) -> Scene:
    """Which material, object and excluded ground each cell of the exemplar belongs to."""
    return read_exr(path.with_name("materials.exr"), most=most, part=part, channel=channel)


@reader("maps.npz")
def read_pose_maps(
    path: Path, *, most: int, colour: str | None = None, part: str | None = None, channel: str | None = None
) -> Scene:
    """The field by the uncertainty that its maps gave it; with --part or --channel the maps themselves."""
    maps, uncertainty = pose_maps.read_pose_maps(path)
    if part is not None or channel is not None:
        with wrap_errors(path):
            known = {"opacity": maps.opacity} | ({} if maps.w2_sq is None else {"w2_sq": maps.w2_sq})
            parts = {name: {key: values[i] for key, values in known.items()} for i, name in enumerate(maps.names)}
        return _arrange_pictures(path, parts, part, channel)
    file = find_above(path, "field.ply", folders=2)
    if file is None:
        raise InputError(f"{path}: there is no field.ply beside it, whose Gaussians it describes")
    field = read_field(file)
    if uncertainty.ndim != 1 or len(uncertainty) > len(field) or not np.isfinite(uncertainty).all():
        raise InputError(f"{path}: describes other Gaussians than {file} has; score the poses again")
    field = pose_maps.apply_uncertainty(field, uncertainty.astype(np.float32))
    return arrange_fields(path, [field], None, colour or "uncertainty", most)


@reader(".exr")
def read_exr(path: Path, *, most: int, part: str | None = None, channel: str | None = None) -> Scene:
    """A ground grid, or the part `above` if it is named, as a surface; anything else as pictures."""
    parts = image_files.read_exr_parts(path)
    first, facts = next(iter(parts.values()))
    if len(parts) == 1 and "ground_west" in facts:
        return _show_surface(path, read_ground(path), first, channel, most)
    if part == "above" and part in parts:
        file = find_above(path, "ground.exr", folders=2)
        if file is None:
            raise InputError(f"{path}: there is no ground.exr beside it, on which its part {part} is drawn")
        return _show_surface(path, read_ground(file), parts[part][0], channel, most)
    return _arrange_pictures(path, {name: channels for name, (channels, _) in parts.items()}, part, channel)


def _arrange_pictures(path: Path, parts: dict[str, dict[str, Array]], part: str | None, channel: str | None) -> Scene:
    """Each selected channel of each selected part, in rows from the top left, with one scale for each channel."""
    selected = parts if part is None else {part: parts[choose("part", part, tuple(parts), path)]}
    if channel is not None:
        choose("channel", channel, tuple(sorted({name for each in selected.values() for name in each})), path)
    found = [(name, key, values) for name, channels in selected.items() for key, values in channels.items()]
    shown = [each for each in found if channel in (None, each[1]) and each[2].ndim == 2][:MAX_PICTURES]
    bars = {key: np.concatenate([v.ravel() for _, other, v in shown if other == key]) for _, key, _ in shown}
    bars = {key: Bar.of_values(key, values, _choose_map(key), HIGHEST) for key, values in bars.items()}
    notes = [f"parts: {len(parts)}; pictures: {len(shown)} of {len(found)}; grey: not a number"]
    scene = Scene(str(path), notes, bars=list(bars.values()), viewer=(0.0, 0.0, 1.0))
    aspect = max(values.shape[0] / values.shape[1] for _, _, values in shown)
    columns = min(len(shown), ceil((len(shown) * ASPECT * aspect) ** 0.5))
    for i, (name, key, values) in enumerate(shown):
        at = np.array([(i % columns) * 1.12, -(i // columns) * (aspect + 0.12 + LETTER), 0.0])
        height, step = values.shape[0] / values.shape[1], ceil(max(values.shape) / MAX_SIDE)
        scene.add_picture(bars[key].map(values[::step, ::step]), at, np.array([1.0, 0, 0]), np.array([0.0, -height, 0]))
        scene.add_label(f"{name} {key}".strip(), at + [0.5, -height - LETTER, 0.0], LETTER)
    return scene


def _choose_map(channel: str) -> str:
    return UNCERTAINTY_MAP if channel in ("opacity", "w2_sq", "uncertainty") else "viridis"


def _show_surface(path: Path, grid: Ground, channels: dict[str, Array], channel: str | None, most: int) -> Scene:
    """The ground's surface, coloured by a channel. Rows of a channel run from the north, as in the file."""
    first = next((name for name in ("Z", "uncertainty") if name in channels), next(iter(channels)))
    name = choose("channel", channel, (first, *sorted(set(channels) - {first})), path)
    values = channels[name]
    if values.shape != grid.shape:
        raise InputError(f"{path}: has {values.shape} cells and the ground beside it {grid.shape}; score again")
    bar = Bar(name) if name in ("uncertainty", "seen") else Bar.of_values(name, values, _choose_map(name))
    step = ceil((values.size / most) ** 0.5) if values.size > most else 1
    scene = Scene(str(path), [f"{grid.shape[1]} x {grid.shape[0]} cells of {grid.spacing:.4g}, by {name}"], bars=[bar])
    scene.add(make_surface(grid, step), bar.map(values[::-1].astype(float)[::step, ::step].ravel()))
    return scene
