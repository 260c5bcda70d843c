"""Checks of stored values: records of a bundle, maps in half precision, orders, tiles of the public renderer."""

from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from numpy import ndarray as Array
from scipy.special import expit

from dav_gswt.bundle import chunks, encoding, gswt, orders
from dav_gswt.field import GaussianField, rgb_to_sh
from dav_gswt.views import pose_maps
from dav_gswt.views.pose_maps import PoseMaps
from dav_gswt_study.stability.formula import FLOAT32, FLOAT32_EPS, Case, Check

COUNT = 200
PIXELS = 128  # of the nearest visible ground, along a tile's side
SIDES = (1e-12, 1e-3, 1.0, 1e6)


@cache
def make_splats(side: float = 1.0) -> GaussianField:
    """Splats over a tile of that side and half of its neighbours: opacities 0 to 1, colours beyond [0, 1], quaternions
    of any length, scales over the whole range of a record.
    """
    rng = np.random.default_rng(0)
    thinnest, widest = np.log(encoding.MIN_PIXELS * side / PIXELS), np.log(encoding.MAX_TILE_SIDES * side)
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
def round_trip(side: float = 1.0) -> GaussianField:
    """The same splats after writing and reading a chunk."""
    field = make_splats(side)
    code = encoding.Encoding.fit([field], side, side / PIXELS)
    with TemporaryDirectory() as folder:
        rows, none = code.encode(field), np.empty((0, COUNT), np.uint16)
        entry = chunks.write_chunk(rows, none, folder, "chunk.bin", chunks.ChunkOrders(0, []))
        return chunks.read_chunk(folder, entry, code)[0]


def _all_splats(along: Array | None = None, at: str = "all splats") -> list[Case]:
    return [Case(at, (), along)]


def _side_cases() -> list[Case]:
    return [Case(f"tiles {side:g} wide", (side,)) for side in SIDES]


def _sorted_deviations(field: GaussianField) -> Array:
    """Scales of each splat, largest first: a record may permute the axes."""
    return -np.sort(-np.exp(field.log_scales.astype(np.float64)), 1)


def _normalise_quats(quats: Array) -> Array:
    """Unit quaternions with w >= 0."""
    q = quats.astype(np.float64)
    q /= np.abs(q).max(1, keepdims=True)
    return q * np.where(q[:, :1] < 0, -1, 1) / np.sqrt((q**2).sum(1, keepdims=True))


def _rotation_error() -> Array:
    """Sine of half the angle between each stored and decoded rotation, axes permuted as in the record."""
    a, b = encoding.find_smallest_rotations(make_splats().quats)[0], _normalise_quats(round_trip().quats)
    return np.sqrt(np.clip(1 - (a * b).sum(1) ** 2, 0, None))


def _opacity_cases() -> list[Case]:
    values = np.concatenate([[0.0], 10.0 ** np.linspace(-12, 0, 97), np.linspace(0, 1, 257)]).astype(np.float32)
    return [Case("opacity ", (values,), values)]


def _round_trip_maps(values: Array) -> Array:
    with TemporaryDirectory() as folder:
        path = Path(folder, "maps.npz")
        pose_maps.write_pose_maps(
            path, PoseMaps(["c0000"], values.reshape(1, 1, -1), None, np.ones((1, 1), np.float32)), values
        )
        return pose_maps.read_pose_maps(path)[0].opacity.ravel()


def _half_cases() -> list[Case]:
    rng = np.random.default_rng(0)
    return [
        Case(f"a million values about {v:g}", (rng.uniform(0.5, 1.5, 1 << 20).astype(np.float16) * np.float16(v),))
        for v in (1e-3, 1.0, 1e3)
    ]


def _mean_of_halves(values: Array) -> float:
    """As maps are read: in float32."""
    return float(values.astype(np.float32).mean(dtype=np.float32))


def _public_quats() -> Array:
    return gswt.to_renderer(make_splats(), 4.0).quats.astype(np.float64)


def _depth_cases() -> list[Case]:
    rng, cases = np.random.default_rng(0), []
    for size in (1e-12, 1.0, 1e6):
        means = (rng.uniform(-1, 1, (300, 3)) * size).astype(np.float32)
        means[100:200] = means[:100]  # equal depths: the smaller index first
        cases.append(Case(f"splats {size:g} apart", (means, orders.DirectionRings().directions()[3])))
    return cases


def _order_reference(means: Array, along: Array) -> list[int]:
    depth = means.astype(np.float64) @ along
    return sorted(range(len(means)), key=lambda i: (-depth[i], i))


SIZE = float(
    np.expm1(
        np.log(encoding.MAX_TILE_SIDES * PIXELS / encoding.MIN_PIXELS) / (2 * encoding.SCALE_STEPS) + 4 * FLOAT32_EPS
    )
)
TURN = float(
    np.sqrt(3) * encoding.MAX_COMPONENT / (2 * encoding.ROTATION_STEPS) / np.sqrt(1 - 3 * encoding.MAX_COMPONENT**2)
)
CHECKS = [
    Check(
        "mean of values kept in half precision",
        _half_cases,
        _mean_of_halves,
        lambda values: float(values.astype(np.float64).mean()),
        relative=FLOAT32,
        printed=lambda values: float(np.add.accumulate(values, dtype=np.float16)[-1]) / len(values),
    ),
    Check(
        "opacity of a map, read back",
        _opacity_cases,
        _round_trip_maps,
        lambda values: values.astype(np.float64),
        relative=2.0**-11,
        absolute=2.0**-25,
    ),
    Check(
        "positions, in tile sides",
        _side_cases,
        lambda side: round_trip(side).means.astype(np.float64) / side,
        lambda side: make_splats(side).means.astype(np.float64) / side,
        relative=FLOAT32_EPS,
        absolute=2 / encoding.POSITION_STEPS,
    ),
    Check(
        "standard deviations, in tile sides",
        _side_cases,
        lambda side: _sorted_deviations(round_trip(side)) / side,
        lambda side: _sorted_deviations(make_splats(side)) / side,
        relative=SIZE,
    ),
    Check(
        "colours",
        _all_splats,
        lambda: round_trip().base_colours,
        lambda: np.clip(make_splats().base_colours.astype(np.float64), 0, 1),
        absolute=1 / 510 + 1e-6,
    ),
    Check(
        "opacities",
        lambda: _all_splats(make_splats().opacity_logits, "logit "),
        lambda: expit(round_trip().opacity_logits.astype(np.float64)),
        lambda: expit(make_splats().opacity_logits.astype(np.float64)),
        absolute=1 / 510 + 1e-6,
    ),
    Check(
        "rotations: sine of half the angle of the error",
        _all_splats,
        _rotation_error,
        lambda: np.zeros(COUNT),
        absolute=TURN,
    ),
    Check(
        "quaternions of the public renderer's tiles",
        _all_splats,
        _public_quats,
        lambda: _normalise_quats(make_splats().quats) * np.where(make_splats().quats[:, :1] < 0, -1, 1),
        absolute=4 * FLOAT32_EPS,
    ),
    Check("order from back to front", _depth_cases, orders.sort_back_to_front, _order_reference),
]
