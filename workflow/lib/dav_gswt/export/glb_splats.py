"""Gaussians in a GLB: points with the attributes of KHR_gaussian_splatting. Axes: right, up, back.

Source: https://github.com/KhronosGroup/glTF/tree/main/extensions/2.0/Khronos/KHR_gaussian_splatting (ratified 2026).
A program that does not know the extension shows coloured points.
"""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float, Float32
from numpy import ndarray as Array
from scipy.special import expit

from dav_gswt.export.axes import Y_UP, turn_points, turn_quats
from dav_gswt.export.glb import GlbWriter
from dav_gswt.export.spool import Spool
from dav_gswt.field import SH0

EXTENSION = "KHR_gaussian_splatting"
COLOUR_SPACE = "srgb_rec709_display"
BYTES = 60  # of a Gaussian
HEADER_BYTES = 65_536  # more than the JSON of one set has


def write_glb_splats(
    spool: Spool, path: Path | str, extras: dict[str, Any], rotation: Float[Array, "3 3"] = Y_UP
) -> None:
    """Write Gaussians as one primitive. extras: of its node. rotation: rows of `axes.AXES`."""
    attributes: dict[str, int] = {}
    glb = begin_glb(attributes, extras)
    n = len(spool)
    bounds = find_bounds(spool, rotation)
    attributes["POSITION"] = glb.add((turn_points(v, rotation) for v in spool.read("means")), n, 3, bounds=bounds)
    attributes["COLOR_0"] = glb.add(_read_fallback(spool), n, 4, "|u1", normalized=True)
    scales = (np.exp(v.astype(float)).astype(np.float32) for v in spool.read("log_scales"))
    quats = (turn_quats(v, rotation)[:, [1, 2, 3, 0]] for v in spool.read("quats"))
    attributes[f"{EXTENSION}:SCALE"] = glb.add(scales, n, 3)
    attributes[f"{EXTENSION}:ROTATION"] = glb.add(quats, n, 4)
    attributes[f"{EXTENSION}:OPACITY"] = glb.add(map(_to_opacity, spool.read("opacity_logits")), n, 1)
    attributes[f"{EXTENSION}:SH_DEGREE_0_COEF_0"] = glb.add(spool.read("dc"), n, 3)
    glb.write(path)


def begin_glb(
    attributes: dict[str, int], extras: dict[str, Any], extensions: dict[str, Any] | None = None
) -> GlbWriter:
    """A GLB of one primitive of Gaussians. attributes: may be filled later. extensions: those of the extension."""
    splats: dict[str, Any] = {
        "kernel": "ellipse",
        "colorSpace": COLOUR_SPACE,
        "sortingMethod": "cameraDistance",
        "projection": "perspective",
    }
    splats |= {"extensions": extensions} if extensions else {}
    primitive = {"mode": 0, "attributes": attributes, "extensions": {EXTENSION: splats}}
    document: dict[str, Any] = {"extensionsUsed": [EXTENSION, *(extensions or {})]}
    document |= {"extensionsRequired": document["extensionsUsed"]} if extensions else {}
    return GlbWriter(
        document
        | {
            "scene": 0,
            "scenes": [{"nodes": [0]}],
            "nodes": [{"mesh": 0, "name": "terrain", "extras": extras}],
            "meshes": [{"name": "terrain", "primitives": [primitive]}],
        }
    )


def _to_opacity(logits: Float32[Array, "n 1"]) -> Float32[Array, "n 1"]:
    return expit(logits.astype(float)).astype(np.float32)


def find_bounds(spool: Spool, rotation: Float[Array, "3 3"]) -> tuple[list[float], list[float]]:
    """The smallest and the largest of each coordinate, as it is stored."""
    ends = [(p.min(0), p.max(0)) for p in (turn_points(v, rotation) for v in spool.read("means"))]
    low, high = np.min([e[0] for e in ends], 0), np.max([e[1] for e in ends], 0)
    return [float(v) for v in low], [float(v) for v in high]


def _read_fallback(spool: Spool) -> Iterator[Array]:
    """COLOR_0: linear colour and opacity in bytes."""
    for dc, logits in zip(spool.read("dc"), spool.read("opacity_logits"), strict=True):
        encoded = np.clip(0.5 + SH0 * dc.astype(float), 0, 1)
        linear = np.where(encoded <= 0.04045, encoded / 12.92, ((encoded + 0.055) / 1.055) ** 2.4)
        yield np.round(255 * np.concatenate([linear, _to_opacity(logits)], 1)).astype(np.uint8)
