"""Made-up bundles: a ground of discs on a grid, one plain colour a tile, levels and orders as the contract has them."""

import hashlib
import json
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float, UInt8
from numpy import ndarray as Array

from dav_gswt.bundle.encoding import Encoding
from dav_gswt.bundle.orders import index_type, presorted
from dav_gswt.field import Field, sh_of

LOOK = np.dtype([("position", "<f4", 3), ("deviation", "<f4", 3), ("paint", "u1", 4), ("turn", "<f4", 4)])
UPRIGHT = (1, 0, 0, 0)
SKY = {"zenith": [0.25, 0.45, 0.8], "horizon": [0.8, 0.85, 0.95]}


@dataclass(frozen=True)
class Ground:
    """What a made-up bundle looks like. Level l has `discs` / 2^l discs along each side of a tile."""

    discs: int = 16
    levels: int = 2
    side: float = 4.0
    variants: int = 1
    salt: int = 7
    eye_floor: float = 0.5
    speckle: int = 0  # largest change of a disc's colour bytes, so that order and place matter
    things: int = 0  # upright blobs a tile


def colour_of(tile: int) -> UInt8[Array, "3"]:
    """The plain colour of a tile, none near black or the sky: red and green by number, blue low."""
    return np.array([120 + 8 * (tile % 16), 190 - 6 * (tile * 7 % 16), 40 + 20 * (tile // 16)], np.uint8)


def directions() -> Float[Array, "9 3"]:
    """Along the four axes, down at 45 degrees in the four diagonals, and straight down."""
    level = [[1, 0, 0], [0, 1, 0], [-1, 0, 0], [0, -1, 0]]
    slanted = [[x, y, -np.sqrt(2)] for x in (1, -1) for y in (1, -1)]
    listed = np.array([*level, *slanted, [0, 0, -1]], float)
    return listed / np.linalg.norm(listed, axis=1, keepdims=True)


def write_bundle(folder: Path, ground: Ground, rows_of=None) -> dict:
    """Write davgswt.json and chunks/ of a made-up ground; returns the manifest.

    `rows_of(ground, tile, level)` gives how a chunk's Gaussians look (default: `discs`).
    """
    (folder / "chunks").mkdir(parents=True)
    looks = [[(rows_of or discs)(ground, t, lv) for lv in range(ground.levels)] for t in range(16 * ground.variants)]
    fields = [[field_of(rows) for rows in levels] for levels in looks]
    encoding = Encoding.of([f for levels in fields for f in levels], ground.side, ground.eye_floor / 1000)
    tiles = [_tile(folder, ground, tile, levels, encoding) for tile, levels in enumerate(fields)]
    spacing = ground.side / ground.discs
    levels = [
        {"level": lv, "mean_scale": spacing * 2**lv, "distance": 2 * ground.side * 2**lv, "band": 0.1 * ground.side}
        for lv in range(ground.levels)
    ]
    levels[-1]["distance"] = None
    manifest = {
        "format": "davgswt",
        "version": 2,
        "unit": "metre",
        "tile_side": ground.side,
        "salt": ground.salt,
        "eye_floor": ground.eye_floor,
        "ground_colour": np.mean([colour_of(t["tile"]) for t in tiles], 0).__truediv__(255).tolist(),
        "sky": SKY,
        "encoding": encoding.json() | {"sh_degree": 0},
        "directions": directions().tolist(),
        "levels": levels,
        "tiles": tiles,
        "provenance": {},
    }
    (folder / "davgswt.json").write_text(json.dumps(manifest))
    return manifest


def field_of(rows: Array) -> Field:
    """Gaussians as they look: records of LOOK, paint with opacity, turns as quaternions w x y z."""
    opacity = np.clip(rows["paint"][:, 3] / 255, 1e-6, 1 - 1e-6)
    return Field(
        rows["position"].astype(np.float32),
        np.log(rows["deviation"]).astype(np.float32),
        rows["turn"].astype(np.float32),
        np.log(opacity / (1 - opacity)).astype(np.float32),
        sh_of((rows["paint"][:, :3] / 255).astype(np.float32)),
        np.zeros(len(rows), np.float32),
        np.zeros(len(rows), bool),
    )


def _tile(folder: Path, ground: Ground, tile: int, fields: list[Field], encoding: Encoding) -> dict:
    chunks = []
    for level, field in enumerate(fields):
        orders = presorted(field.means, directions())
        data = encoding.encoded(field).tobytes() + orders.astype(index_type(len(field))).tobytes()
        name = f"chunks/lod{level}_tile_{tile:02d}.bin"
        (folder / name).write_bytes(data)
        chunks.append(
            {
                "level": level,
                "file": name,
                "bytes": len(data),
                "sha256": hashlib.sha256(data).hexdigest(),
                "count": len(field),
                "orders": list(range(len(orders))),
            }
        )
    return {"tile": tile, "uncertainty": 0.0, "z": [0.0, 0.3 if ground.things else 0.0], "chunks": chunks}


def discs(ground: Ground, tile: int, level: int) -> Array:
    """Overlapping flat discs on the grid of a level, and upright blobs among them."""
    random = np.random.default_rng([tile, level])
    n = ground.discs >> level
    spacing = ground.side / n
    rows = np.zeros(n * n + ground.things, LOOK)
    grid = (np.arange(n) + 0.5) * spacing
    flat, things = rows[: n * n], rows[n * n :]
    flat["position"][:, 0], flat["position"][:, 1] = np.tile(grid, n), np.repeat(grid, n)
    flat["deviation"] = [0.7 * spacing, 0.7 * spacing, 0.02 * spacing]
    things["position"] = random.uniform(0.1 * ground.side, 0.9 * ground.side, (ground.things, 3))
    things["position"][:, 2] = 0.12
    things["deviation"] = [0.05, 0.05, 0.1]
    speckle = random.integers(-ground.speckle, ground.speckle + 1, (len(rows), 1))
    rows["paint"][:, :3] = np.clip(colour_of(tile) + speckle, 0, 255)
    rows["paint"][n * n :, :3] = [40, 70, 30]
    rows["paint"][:, 3] = 250
    rows["turn"] = UPRIGHT
    return rows
