"""Checks of what tiles get from their place and from their recipes: corrections, variation, light of the sun."""

import math
from fractions import Fraction

import numpy as np
from numpy import ndarray as Array

from dav_gswt.bundle.recipes import CHANNELS, coarsen_correction
from dav_gswt.terrain.choice import hash_cell
from dav_gswt.terrain.heights import SHIFT
from dav_gswt.terrain.light import MOST, Light, Sun
from dav_gswt.terrain.variation import VARIATION, make_wave
from dav_gswt_study.stability.formula import Case, Check

SALT = 7
CELLS = 64  # finest cells along a tile
WAVE = 0.63  # width of a wave's cells, in units
SLOPES = np.concatenate([[0.0], 10.0 ** np.linspace(-12, 6, 73)])
ELEVATIONS = 3.0, 5.0, 30.0, 60.0, 90.0


def _correction_cases() -> list[Case]:
    rng, cases = np.random.default_rng(0), []
    for factor in (1, 2, 8, CELLS):
        for most in (1, 1000, 32767):
            values = rng.integers(-most, most + 1, (CHANNELS, CELLS, CELLS)).astype(np.int16)
            labels = rng.integers(0, 3, (CELLS, CELLS)).astype(np.uint8)
            coarse = labels[::factor, ::factor].copy()  # a label that occurs in each coarse cell
            cases.append(Case(f"cells of {factor}, corrections up to {most}", (values, labels, coarse)))
    extreme = np.full((CHANNELS, CELLS, CELLS), -32768, np.int16)
    none = np.zeros((CELLS, CELLS), np.uint8)
    return [*cases, Case("all corrections -32768", (extreme, none, none[:1, :1]))]


def _average_exactly(values: Array, labels: Array, coarse: Array) -> Array:
    """The mean over the finest cells with the coarse cell's label, halves rounded up."""
    factor, means = len(labels) // len(coarse), np.zeros((CHANNELS, *coarse.shape))
    for j, i in np.ndindex(*coarse.shape):
        part = np.s_[j * factor : (j + 1) * factor, i * factor : (i + 1) * factor]
        same = labels[part] == coarse[j, i]
        for c in range(CHANNELS):
            chosen = values[c][part][same].tolist()
            means[c, j, i] = math.floor(Fraction(sum(chosen), len(chosen)) + Fraction(1, 2))
    return means


def _average_in_float32(values: Array, labels: Array, coarse: Array) -> Array:
    factor, k = len(labels) // len(coarse), len(coarse)
    same = labels.reshape(k, factor, k, factor) == coarse[:, None, :, None]
    total = (values.reshape(CHANNELS, k, factor, k, factor) * same).astype(np.float32).sum((2, 4))
    return np.rint(total / same.sum((1, 3)).astype(np.float32))


def _wave_cases() -> list[Case]:
    near = np.random.default_rng(0).uniform(-3, 3, (2, 60))
    return [Case(f"{far} units from the origin", (near[0] + far, near[1] - far)) for far in (0, 2**10, 2**20, 2**26)]


def _wave_exactly(x: Array, y: Array) -> Array:
    """Gradient noise with exact places in its cells."""
    return np.array([_noise_at(Fraction(a), Fraction(b)) for a, b in zip(x.tolist(), y.tolist(), strict=True)])


def _noise_at(x: Fraction, y: Fraction) -> float:
    x, y = x / Fraction(WAVE) + Fraction(SHIFT[0]), y / Fraction(WAVE) + Fraction(SHIFT[1])
    i, j = math.floor(x), math.floor(y)
    u, v = float(x - i), float(y - j)
    fade_x, fade_y = (t**3 * (t * (6 * t - 15) + 10) for t in (u, v))
    value = 0.0
    for b in (0, 1):
        for a in (0, 1):
            bits = int(hash_cell(i + a, j + b, VARIATION + 1, SALT))
            plane = ((bits & 0xFFFF) / 32767.5 - 1) * (u - a) + ((bits >> 16) / 32767.5 - 1) * (v - b)
            value += (fade_x if a else 1 - fade_x) * (fade_y if b else 1 - fade_y) * plane
    return value


def _light_cases() -> list[Case]:
    turns = np.linspace(0, 2 * np.pi, 8, endpoint=False)
    slopes = np.concatenate([SLOPES[:, None] * [np.cos(turn), np.sin(turn)] for turn in turns])
    return [
        Case(
            f"captured at {first:g} degrees, shown at {now:g}, slope ", (first, now, slopes), np.repeat(slopes[:, 0], 3)
        )
        for first in ELEVATIONS
        for now in ELEVATIONS
    ]


def _shade(captured: float, shown: float, slopes: Array) -> Array:
    return Light(Sun(captured, 40.0), Sun(shown, 130.0)).ratio(slopes)


def _shade_by_angles(captured: float, shown: float, slopes: Array) -> Array:
    """By the angles of slope and sun instead of vectors."""
    light = Light(Sun(captured, 40.0), Sun(shown, 130.0))
    direct, ambient = light.terms
    steep = np.arctan(np.hypot(*slopes.T))
    downhill = np.arctan2(-slopes[:, 0], -slopes[:, 1])  # azimuth that the ground faces
    e, a = np.radians(shown), np.radians(130.0)
    facing = np.cos(steep) * np.sin(e) + np.sin(steep) * np.cos(e) * np.cos(downhill - a)
    sky = 0.5 + 0.5 * np.cos(steep)
    return np.minimum(np.maximum(facing, 0)[:, None] * direct + sky[:, None] * ambient, MOST)


CHECKS = [
    Check(
        "recipe: mean correction of a coarser cell",
        _correction_cases,
        coarsen_correction,
        _average_exactly,
        printed=_average_in_float32,
    ),
    Check(
        "variation: a wave far from the origin",
        _wave_cases,
        lambda x, y: make_wave(x, y, 1, WAVE, SALT),
        _wave_exactly,
        absolute=1e-7,
        printed=lambda x, y: make_wave(
            x.astype(np.float32).astype(float), y.astype(np.float32).astype(float), 1, WAVE, SALT
        ),
    ),
    Check(
        "light of a slope over captured light",
        _light_cases,
        _shade,
        _shade_by_angles,
        relative=1e-12,
        absolute=1e-12,
    ),
]
