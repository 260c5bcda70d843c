"""Runs of the whole workflow at extreme settings, and the expected outcome of each."""

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from dav_gswt.field import GaussianField, rgb_to_sh, write_field
from dav_gswt.images import image_files

COUNT = 160  # Gaussians along a side of a world that is given as a field
SIDE = 10.0  # of that world, in its unit

PrepareFolder = Callable[[Path], None]


@dataclass(frozen=True)
class Extreme:
    """One run. about: what is extreme. overrides: of config/test/config.yaml. prepare: writes files to its folder.

    error_pattern: a regular expression that the error message must match; None: the run must finish, with all numbers
    finite. same_as: another run whose stills must look the same.
    """

    name: str
    about: str
    overrides: dict = field(default_factory=dict)
    prepare: PrepareFolder | None = None
    error_pattern: str | None = None
    same_as: str | None = None


def make_ground_field(count: int, side: float) -> GaussianField:
    """A finished field: count x count opaque flat discs on a gentle relief, in blotches of two colours."""
    rng = np.random.default_rng(0)
    step = side / count
    x, y = np.meshgrid((np.arange(count) + 0.5) * step, (np.arange(count) + 0.5) * step)
    waves = rng.uniform(0, 2 * np.pi, (6, 2)), rng.uniform(2, 9, (6, 2)) * 2 * np.pi / side
    parts = (np.sin(k[0] * x + p[0]) * np.sin(k[1] * y + p[1]) for p, k in zip(*waves, strict=True))
    blotch = sum(parts, np.zeros_like(x)).ravel()
    grain = 0.04 * rng.standard_normal((count**2, 1))
    colour = np.array([0.55, 0.45, 0.32]) + 0.07 * blotch[:, None] * np.array([1.0, 0.4, -0.6]) + grain
    n = count**2
    means = np.stack([x.ravel(), y.ravel(), 0.01 * side * blotch / 6], 1)
    return GaussianField(
        means.astype(np.float32),
        np.tile(np.log([0.7 * step, 0.7 * step, 0.05 * step]).astype(np.float32), (n, 1)),
        np.tile(np.array([1, 0, 0, 0], np.float32), (n, 1)),
        np.full(n, 4.0, np.float32),
        rgb_to_sh(np.clip(colour, 0, 1)),
        np.zeros(n, np.float32),
        np.zeros(n, bool),
    )


def write_world(count: int, side: float) -> PrepareFolder:
    """A function that writes such a field as the file of the scene `finished`."""
    return lambda folder: write_field(make_ground_field(count, side), folder / "finished.ply")


def write_single_gaussian(folder: Path) -> None:
    write_field(make_ground_field(1, SIDE), folder / "finished.ply")


def write_two_photos(folder: Path) -> None:
    rng = np.random.default_rng(0)
    (folder / "photos").mkdir()
    for number in range(2):
        image_files.write_png(folder / f"photos/{number}.png", rng.uniform(0, 1, (96, 128, 3)).astype(np.float32))


def override_desert(**keys) -> dict:
    """Overrides of the scene `desert`."""
    return {"scenes": {"desert": keys}}


def override_views(**keys) -> dict:
    """Overrides of a config with the paper's policy, which uses the prior."""
    return {"policy": "w2-lpips", **keys}


FIELD_SCENE = {"scene": "finished"}
FOLDER_SCENE = {"kind": "photos", "folder": "photos", "size": 128, "start": 3, "agent": "replay"}
FOLDER_SCENE |= {"preset": "draft", "tiling": "semantic"}
MILLION = {"fit_size": 128, "spacing": 1.5, "max_gaussians": 2_000_000, "steps": 60, "steps_per_photo": 10}
MILLION |= {"level_steps": 4}
MILLION_SCENE = {"scenes": {"finished": {"preset": "million"}}, "presets": {"million": MILLION}}
FEW = {"fit_size": "native", "spacing": 1.2, "max_gaussians": 5000, "steps": 30, "steps_per_photo": 5}
FOCUS = override_desert(preset="few") | {"presets": {"few": FEW | {"choose_with": "draft", "level_steps": 4}}}

ALL = (
    Extreme(
        "two-photos",
        "one synthetic photo too few",
        override_desert(photo_count=2),
        error_pattern=r"scenes\.desert\.photo_count: .*greater than or equal to 3",
    ),
    Extreme(
        "two-in-folder",
        "one photo too few in a folder",
        {"scene": "folder", "scenes": {"folder": FOLDER_SCENE}},
        write_two_photos,
        error_pattern="at least 3 overlapping photos are needed",
    ),
    Extreme(
        "all-start",
        "all photos are start photos: no candidates",
        override_desert(agent="replay", photo_count=5, start=6),
    ),
    Extreme("k-pool", "k is the number of candidates", {"k": 6} | override_desert(candidates=6)),
    Extreme("k-over-pool", "k is far above the number of candidates", {"k": 1000} | override_desert(candidates=6)),
    Extreme("lam-0", "lambda 0", override_views(lam=0)),
    Extreme("lam-1e6", "lambda 1e6", override_views(lam=1_000_000)),
    Extreme("tau-0", "tau 0: every tile keeps all orders", {"tau": 0}),
    Extreme("tau-1", "tau 1: no tile keeps all orders", {"tau": 1}),
    Extreme("pdrop-0", "no dropout: all samples are equal", override_views(p_drop=0)),
    Extreme("pdrop-0.95", "19 of 20 of the attention dropped", override_views(p_drop=0.95)),
    Extreme("low-sun", "the captured sun 3 degrees above the horizon", {"sun": {"elevation": 3, "azimuth": 90}}),
    Extreme("variation-4", "four times the variation of the exemplar, the most that is allowed", {"variation": 4}),
    Extreme("focus", "only windows are fitted, with 5000 Gaussians", FOCUS),
    Extreme(
        "one-gaussian",
        "a field of one Gaussian",
        FIELD_SCENE,
        write_single_gaussian,
        error_pattern="1 opaque Gaussians",
    ),
    Extreme("world-1", "a finished field of usual size, to compare with", FIELD_SCENE, write_world(COUNT, SIDE)),
    Extreme(
        "world-1e-3",
        "that field, a thousandth as large",
        FIELD_SCENE,
        write_world(COUNT, 1e-3 * SIDE),
        same_as="world-1",
    ),
    Extreme(
        "world-1e6",
        "that field, a million times as large",
        FIELD_SCENE,
        write_world(COUNT, 1e6 * SIDE),
        same_as="world-1",
    ),
    Extreme("million", "a finished field of a million Gaussians", FIELD_SCENE | MILLION_SCENE, write_world(1000, SIDE)),
)
EXTREMES = {extreme.name: extreme for extreme in ALL}
