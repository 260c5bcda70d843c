"""What is stored in less than float32: a bundle's records, maps in half precision; and what is derived on writing."""

from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from numpy import ndarray as Array
from scipy.special import expit

from dav_gswt.bundle import chunks, encoding, gswt, orders
from dav_gswt.field import GaussianField, rgb_to_sh
from dav_gswt.study.stability.formula import LAW, SINGLE, Formula, Point, Tolerance
from dav_gswt.study.stability.scoring import EXACT
from dav_gswt.views import pose_maps
from dav_gswt.views.pose_maps import PoseMaps

COUNT = 200


PIXELS = 128  # of the nearest ground in sight, along a tile's side
SIDES = (1e-12, 1e-3, 1.0, 1e6)


@cache
def splats(side: float = 1.0) -> GaussianField:
    """Over a tile of that side and half of its neighbours: opacities 0 to 1, colours beyond both ends, quaternions of
    any length, deviations of all that a record tells apart.
    """
    rng = np.random.default_rng(0)
    thinnest, widest = np.log(encoding.SLIGHTEST * side / PIXELS), np.log(encoding.WIDEST * side)
    sizes = np.linspace(thinnest, widest, COUNT)
    return GaussianField(
        (rng.uniform(-0.5, 1.5, (COUNT, 3)) * side).astype(np.float32),
        np.column_stack([sizes, sizes[::-1], rng.permutation(sizes)]).astype(np.float32),
        (rng.standard_normal((COUNT, 4)) * 10 ** rng.uniform(-25, 25, (COUNT, 1))).astype(np.float32),
        np.concatenate([[-1e4, 1e4], np.linspace(-20, 20, COUNT - 2)]).astype(np.float32),
        rgb_to_sh(rng.uniform(-0.2, 1.2, (COUNT, 3))),
        np.zeros(COUNT, np.float32),
        np.zeros(COUNT, bool),
    )


@cache
def read_back(side: float = 1.0) -> GaussianField:
    """The same from a bundle's chunk."""
    field = splats(side)
    code = encoding.Encoding.of([field], side, side / PIXELS)
    with TemporaryDirectory() as folder:
        entry = chunks.write(code.encoded(field), np.empty((0, COUNT), np.uint16), Path(folder, "chunk.bin"))
        return chunks.read(folder, entry | {"file": "chunk.bin", "orders": []}, code)[0]


def _all(along: Array | None = None, at: str = "all splats") -> list[Point]:
    return [Point(at, (), along)]


def _sides() -> list[Point]:
    return [Point(f"tiles {side:g} wide", (side,)) for side in SIDES]


def _deviations(field: GaussianField) -> Array:
    """Of each splat from its longest axis to its shortest: a record may name the axes anew."""
    return -np.sort(-np.exp(field.log_scales.astype(np.float64)), 1)


def _unit(quats: Array) -> Array:
    """Of length 1, w not below 0."""
    q = quats.astype(np.float64)
    q /= np.abs(q).max(1, keepdims=True)
    return q * np.where(q[:, :1] < 0, -1, 1) / np.sqrt((q**2).sum(1, keepdims=True))


def _sines() -> Array:
    """Of half the angle between what was stored, its axes named as a record names them, and what came back."""
    a, b = encoding.smallest_turns(splats().quats)[0], _unit(read_back().quats)
    return np.sqrt(np.clip(1 - (a * b).sum(1) ** 2, 0, None))


def _shares() -> list[Point]:
    values = np.concatenate([[0.0], 10.0 ** np.linspace(-12, 0, 97), np.linspace(0, 1, 257)]).astype(np.float32)
    return [Point("opacity ", (values,), values)]


def _through_maps(values: Array) -> Array:
    with TemporaryDirectory() as folder:
        path = Path(folder, "maps.npz")
        pose_maps.write_pose_maps(path, PoseMaps(["c0000"], values.reshape(1, 1, -1), None), values)
        return pose_maps.read_pose_maps(path)[0].opacity.ravel()


def _halves() -> list[Point]:
    rng = np.random.default_rng(0)
    return [
        Point(f"a million values about {v:g}", (rng.uniform(0.5, 1.5, 1 << 20).astype(np.float16) * np.float16(v),))
        for v in (1e-3, 1.0, 1e3)
    ]


def _mean(values: Array) -> float:
    """As maps are read: float32 first."""
    return float(values.astype(np.float32).mean(dtype=np.float32))


def _rows() -> Array:
    return gswt.rows(splats(), 4.0)[:, 58:].astype(np.float64)


def _depths() -> list[Point]:
    rng, found = np.random.default_rng(0), []
    for size in (1e-12, 1.0, 1e6):
        means = (rng.uniform(-1, 1, (300, 3)) * size).astype(np.float32)
        means[100:200] = means[:100]  # equal depths: the smaller index first
        found.append(Point(f"splats {size:g} apart", (means, orders.Rings().directions()[3])))
    return found


def _order_slowly(means: Array, along: Array) -> list[int]:
    depth = means.astype(np.float64) @ along
    return sorted(range(len(means)), key=lambda i: (-depth[i], i))


SIZE = float(np.expm1(np.log(encoding.WIDEST * PIXELS / encoding.SLIGHTEST) / (2 * encoding.SIZES) + 4 * SINGLE))
TURN = float(np.sqrt(3) * encoding.STEEPEST / (2 * encoding.TURNS) / np.sqrt(1 - 3 * encoding.STEEPEST**2))
RECORD, SUMS = "a bundle's record, 16 bytes", "sums"
FORMULAS = [
    Formula(
        SUMS,
        "mean of values kept in half precision",
        "maps.npz",
        "a million values of 1e-3 to 1e3",
        "float16",
        _halves,
        _mean,
        lambda values: float(values.astype(np.float64).mean()),
        Tolerance(LAW[0], 0.0, LAW[1]),
        lambda values: float(np.add.accumulate(values, dtype=np.float16)[-1]) / len(values),
    ),
    Formula(
        "storage",
        "opacity of a map, read back",
        "maps.npz",
        "0 and 1e-12 to 1",
        "float16",
        _shares,
        _through_maps,
        lambda values: values.astype(np.float64),
        Tolerance(2.0**-11, 2.0**-25, "11 bits, and half of the smallest float16 of all"),
    ),
    Formula(
        "storage",
        "positions, in tile sides",
        RECORD,
        "tiles 1e-12 to 1e6 wide, splats half a side beyond",
        "16 bits",
        _sides,
        lambda side: read_back(side).means.astype(np.float64) / side,
        lambda side: splats(side).means.astype(np.float64) / side,
        Tolerance(SINGLE, 2 / encoding.PLACES, "a step of 16 bits over two sides: the outermost are moved to the rim"),
    ),
    Formula(
        "storage",
        "standard deviations, in tile sides",
        RECORD,
        "1 / 64 of a pixel to 4 sides of tiles 1e-12 to 1e6 wide",
        "8 bits",
        _sides,
        lambda side: _deviations(read_back(side)) / side,
        lambda side: _deviations(splats(side)) / side,
        Tolerance(SIZE, 0.0, "half a step of 8 bits of the logarithm"),
    ),
    Formula(
        "storage",
        "colours",
        RECORD,
        "0 to 1; beyond, the end",
        "8 bits",
        _all,
        lambda: read_back().base_colours,
        lambda: np.clip(splats().base_colours.astype(np.float64), 0, 1),
        Tolerance(0.0, 1 / 510 + 1e-6, "half a step of 8 bits"),
    ),
    Formula(
        "storage",
        "opacities",
        RECORD,
        "logits -1e4 to 1e4",
        "8 bits",
        lambda: _all(splats().opacity_logits, "logit "),
        lambda: expit(read_back().opacity_logits.astype(np.float64)),
        lambda: expit(splats().opacity_logits.astype(np.float64)),
        Tolerance(0.0, 1 / 510 + 1e-6, "half a step of 8 bits"),
    ),
    Formula(
        "storage",
        "turns: sine of half the angle lost",
        RECORD,
        "quaternions of 1e-25 to 1e25",
        "8 bits",
        _all,
        _sines,
        lambda: np.zeros(COUNT),
        Tolerance(0.0, TURN, "three components, each half a step of sin(22.5 degrees) / 127 off, over the least w"),
    ),
    Formula(
        "storage",
        "quaternions of the public renderer's tiles",
        "gswt.zip",
        "quaternions of 1e-25 to 1e25",
        "float32",
        _all,
        _rows,
        lambda: _unit(splats().quats) * np.where(splats().quats[:, :1] < 0, -1, 1),
        Tolerance(0.0, 4 * SINGLE, "roundings of float32"),
    ),
    Formula(
        "storage",
        "order from back to front",
        "pre-sorted orders",
        "1e-12 to 1e6, ties",
        "float64",
        _depths,
        orders.back_to_front,
        _order_slowly,
        EXACT,
    ),
]
