"""How sharp the ground of a terrain is beside the photos that it was made from.

- Cell ratio: the width of a ground cell over the width of a photo's pixel on the ground, the median over the photos
  that see the middle of the window. A window is the square of ground that a material's tiles are cut from.
- Detail: power above half the photos' Nyquist frequency in renders of the field, over the photos' own there. Narrow
  cells alone are not sharpness.
- Crop distance: LPIPS of a crop of the terrain, as the eye sees it straight below, to its nearest crop of the photos
  at the same ground scale.
"""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from jaxtyping import Bool, Float, Float32
from numpy import ndarray as Array
from PIL import Image

from dav_gswt.bundle.store import Bundle
from dav_gswt.field import GaussianField
from dav_gswt.geometry.cameras import Camera
from dav_gswt.images import metrics
from dav_gswt.images.lpips_weights import Weights
from dav_gswt.materials.store import read_exemplars
from dav_gswt.photos.training_views import TrainingView, mask_outside_ground
from dav_gswt.raster import render
from dav_gswt.reconstruction.ground import Ground
from dav_gswt.terrain import endless, stills
from dav_gswt_study.seams.perceptual_distance import embed_images, pairwise_distances

CROP = 64  # pixels of a crop
BLOCK = 96  # pixels of a square whose spectrum is taken
TOPMOST = 12  # photos that look most steeply down: their spectra, and their crops
BANK = 600  # crops of the photos, at most
COARSER = 1.1  # times the median pixel: photos with wider ones give no crops
CROPS = 60  # of the terrain


@dataclass(frozen=True)
class Window:
    """A square of ground that tiles are cut from. spacing: width of its cells; height: of its middle."""

    west: float
    south: float
    side: float
    spacing: float
    height: float

    @staticmethod
    def from_grid(grid: Ground) -> "Window":
        west, south, side = grid.exemplar
        return Window(west, south, side, grid.spacing, float(np.median(grid.heights)))

    @property
    def middle(self) -> Float[Array, "3"]:
        return np.array([self.west + self.side / 2, self.south + self.side / 2, self.height])


def read_windows(materials: Path | str) -> list[Window]:
    """The windows of a folder of materials. Raises: InputError: not such a folder."""
    return [Window.from_grid(grid) for _, grid in read_exemplars(materials)]


def measure_pixel_width(window: Window, shots: list[Camera]) -> float:
    """Median width on the ground of a pixel in the window's middle, over the cameras that see it."""
    widths = []
    for camera in shots:
        (pixel,), (depth,) = camera.project(window.middle[None])
        if depth > 0 and 0 <= pixel[0] < camera.width and 0 <= pixel[1] < camera.height:
            widths.append(depth / camera.fx)
    return float(np.median(widths)) if widths else float("nan")


def mask_to_windows(view: TrainingView, windows: list[Window]) -> TrainingView:
    """The view, counting where it looks at a window."""
    parts = [mask_outside_ground(view, w.west, w.south, w.west + w.side, w.south + w.side).weight for w in windows]
    return view.with_pixels(weight=np.max(parts, 0))


def compare_detail(field: GaussianField, views: list[TrainingView]) -> float:
    """Power above half the Nyquist frequency, field over photos: the median over squares that count whole."""
    shares = []
    for view in find_steepest(views):
        seen = np.clip(render(field, view.camera).colour, 0, 1)
        for box in list_boxes(view.weight, BLOCK):
            photo, own = view.image[box], seen[box]
            own = metrics.correct_colours(own, photo, np.ones(photo.shape[:2], np.float32))
            shares.append(measure_fine_power(own) / max(measure_fine_power(photo), 1e-12))
    return float(np.median(shares)) if shares else float("nan")


def find_steepest(views: list[TrainingView]) -> list[TrainingView]:
    """The views that count anywhere and look most steeply down."""
    return sorted((v for v in views if v.weight.any()), key=lambda v: v.camera.forward[2])[:TOPMOST]


def list_boxes(weight: Float32[Array, "h w"], side: int) -> list[tuple[slice, slice]]:
    """Squares side by side in which every pixel counts."""
    starts = [range(0, n - side + 1, side) for n in weight.shape]
    boxes = [np.s_[row : row + side, column : column + side] for row in starts[0] for column in starts[1]]
    return [box for box in boxes if weight[box].all()]


def measure_fine_power(picture: Float[Array, "n n 3"]) -> float:
    """Power of brightness between half the Nyquist frequency and the Nyquist frequency."""
    bright = picture.mean(-1) - picture.mean()
    window = np.hanning(len(bright))
    power = np.abs(np.fft.fft2(bright * np.outer(window, window))) ** 2
    frequency = np.hypot(*np.meshgrid(np.fft.fftfreq(len(bright)), np.fft.fftfreq(len(bright))))
    return float(power[_between(frequency, 0.25, 0.5)].sum())


def _between(values: Array, low: float, high: float) -> Bool[Array, "..."]:
    return (values > low) & (values <= high)


def cut_photo_crops(
    views: list[TrainingView], windows: list[Window], pixel: float, rng: np.random.Generator
) -> Float32[Array, "n c c 3"]:
    """Crops of photos inside the windows, `pixel` world units a pixel."""
    crops, height = [], float(np.mean([w.height for w in windows]))
    for view in find_steepest(views):
        own = (view.camera.centre[2] - height) / view.camera.fx
        side = round(CROP * pixel / own)
        if own > COARSER * pixel or side < CROP // 2:
            continue
        for row, column in np.argwhere(view.weight > 0)[:: max(1, side // 2)]:
            box = np.s_[row : row + side, column : column + side]
            if view.weight[box].shape == (side, side) and view.weight[box].all():
                crops.append((view, box))
    pick = rng.choice(len(crops), min(BANK, len(crops)), replace=False)
    return np.stack([_resize(crops[k][0].image[crops[k][1]]) for k in pick])


def _resize(crop: Float32[Array, "n n 3"]) -> Float32[Array, "c c 3"]:
    layers = [Image.fromarray(crop[..., c]).resize((CROP, CROP), Image.Resampling.LANCZOS) for c in range(3)]
    return np.clip(np.dstack([np.asarray(layer) for layer in layers]), 0, 1).astype(np.float32)


def render_terrain_crops(bundle: Bundle, pixel: float, rng: np.random.Generator) -> Float32[Array, "n c c 3"]:
    """Crops of the terrain from the eye's lowest height straight down, `pixel` world units a pixel."""
    terrain, manifest = endless.terrain_from_bundle(bundle, {"kind": "flat"}), bundle.manifest
    found = []
    for at in rng.uniform(0, 20, (CROPS, 2)).tolist():
        shot = stills.Shot("crop", tuple(at), 1.0, 90.0, 90.0)
        focal = manifest.eye_floor / pixel
        camera = replace(stills.shot_camera(shot, terrain, manifest.eye_floor, CROP, CROP), fx=focal, fy=focal)
        found.append(stills.render_view(terrain, camera, manifest.sky, manifest.ground_colour))
    return np.clip(np.stack(found), 0, 1).astype(np.float32)


def measure_crop_distances(
    terrain: Float32[Array, "n c c 3"], photos: Float32[Array, "m c c 3"], weights: Weights
) -> Float[Array, "n"]:
    """LPIPS of each crop of the terrain to its nearest crop of the photos."""
    return pairwise_distances(embed_images(terrain, weights)[0], embed_images(photos, weights)[0]).min(1)


def bootstrap_difference(
    before: Float[Array, "n"], after: Float[Array, "m"], rng: np.random.Generator
) -> tuple[float, float, float]:
    """Difference of the means (`after` minus `before`), and the bounds of its 95 % bootstrap interval."""
    means = [rng.choice(part, (10_000, len(part))).mean(1) for part in (after, before)]
    low, high = np.quantile(means[0] - means[1], [0.025, 0.975])
    return float(after.mean() - before.mean()), float(low), float(high)
