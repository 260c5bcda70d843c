"""The ground for MuJoCo: a height field in its binary form, and a model (MJCF) of it with the objects' hulls.

Source: https://mujoco.readthedocs.io/en/stable/XMLreference.html#asset-hfield. z is up; the frame is the exports'.
"""

from collections.abc import Sequence
from pathlib import Path
from xml.sax.saxutils import quoteattr

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array

from dav_gswt.export.ground_surface import GroundSurface
from dav_gswt.export.hulls import Hull
from dav_gswt.files import atomic_file

FLOOR = 0.5  # thickness below the lowest point, in tile sides: nothing thin falls through


def write_hfield(surface: GroundSurface, path: Path | str) -> None:
    """Numbers of rows and columns as int32, then heights as float32, from south to north and west to east."""
    with atomic_file(path) as part, part.open("wb") as file:
        file.write(np.array(surface.heights.shape, "<i4").tobytes())
        file.write(np.ascontiguousarray(surface.heights, "<f4").tobytes())


def write_model(
    surface: GroundSurface, hulls: Sequence[Hull], origin: Float[Array, "3"], hfield: str, path: Path | str
) -> None:
    """Write the model. hfield: the name of the file of `write_hfield` beside it."""
    rows, columns = surface.heights.shape
    half = np.array([columns - 1, rows - 1]) * surface.step / 2
    low, high = float(surface.heights.min()), float(surface.heights.max())
    size = [*half.tolist(), max(high - low, 1e-6), FLOOR * surface.block * surface.step]
    middle = [*(np.array([surface.west, surface.south]) + half - origin[:2]).tolist(), low - float(origin[2])]
    assets = [f'    <hfield name="ground" file={quoteattr(hfield)} size="{_numbers(size)}"/>']
    geoms = [f'    <geom name="ground" type="hfield" hfield="ground" pos="{_numbers(middle)}"/>']
    for hull in hulls:
        name = quoteattr(hull.name)
        assets.append(f'    <mesh name={name} vertex="{_numbers(hull.vertices.ravel().tolist())}"/>')
        geoms.append(f'    <geom name={name} type="mesh" mesh={name} rgba="0.45 0.42 0.36 1"/>')
    lines = [
        '<mujoco model="terrain">',
        "  <asset>",
        *assets,
        "  </asset>",
        "  <worldbody>",
        '    <light directional="true" pos="0 0 100" dir="0.3 0.2 -1"/>',
        *geoms,
        "  </worldbody>",
        "</mujoco>",
    ]
    with atomic_file(path) as part:
        part.write_text("\n".join(lines) + "\n", encoding="utf-8")


def _numbers(values: Sequence[float]) -> str:
    return " ".join(f"{value:.7g}" for value in values)
