"""The paper's evolution figure: two test views, each in several fits, with error maps.

Errors are relative to the photo, not to the last field as in the paper.
Source: DAV-GSWT, figure on iterative reconstruction evolution.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float32
from numpy import ndarray as Array

from dav_gswt.errors import InputError
from dav_gswt.field import GaussianField
from dav_gswt.geometry.scene_frame import SceneFrame
from dav_gswt.images import figures, metrics
from dav_gswt.photos.training_views import TrainingView
from dav_gswt.raster import render
from dav_gswt.reconstruction.ground import Ground
from dav_gswt.reconstruction.observation import mask_to_ground

WIDE = 9.0  # inches of the figure
HEAD, LABEL, FOOT, KEY = 0.25, 0.25, 0.5, 0.85  # inches: titles, a line under maps, two under all, the colours' scale
NOTE = 0.2  # inches: a line more under all
GREY = 0.75  # of what does not count
FADED = 0.8  # how grey a picture becomes where it does not count
HIGHEST = 0.99  # quantile of all errors at which their colours end
MAP = "magma"


@dataclass(frozen=True)
class Column:
    """A fit, and what stands over it and under its measures. metrics: its metrics.json."""

    title: str
    field: GaussianField
    grid: Ground
    metrics: dict
    note: str = ""


@dataclass(frozen=True)
class Look:
    """A test view in a column. error: mean of |picture - photo| over the channels, NaN where the pixel does not
    count. row: the view's measures, of metrics.json."""

    picture: Float32[Array, "h w 3"]
    error: Float32[Array, "h w"]
    row: dict


@dataclass(frozen=True)
class Strip:
    """A test view and how it looks in each column. why: it is shown."""

    name: str
    why: str
    photo: Float32[Array, "h w 3"]
    looks: list[Look]


def psnr_key(frame: SceneFrame) -> str:
    """The key of PSNR in metrics.json: colour-corrected for photos, which change their exposure."""
    return "psnr_colour_corrected" if frame.kind == "photos" else "psnr"


def choose_test_views(first: Column, key: str) -> dict[str, str]:
    """The test views to show, by name, and why: the worst and the median one of a column by PSNR.

    Of an even number the better one of the middle two; one test view is shown alone.
    Raises: InputError: there is no test view.
    """
    rows = sorted(first.metrics["test_views"], key=lambda row: np.inf if row[key] is None else row[key])
    if not rows:
        raise InputError(
            f"metrics.json of {first.title}: has no test view, so there is none to show; give the scene some"
        )
    if len(rows) == 1:
        return {rows[0]["view"]: "the only test view"}
    whys = {
        0: f"the worst of {len(rows)}\ntest views at {first.title}",
        len(rows) // 2: f"the median one\nat {first.title}",
    }
    return {rows[i]["view"]: why for i, why in whys.items()}


def build_strips(columns: list[Column], tests: list[TrainingView], key: str) -> list[Strip]:
    """The test views that the first column chooses, in every column. key: see `psnr_key`."""
    views = {view.name: view for view in tests}
    found = []
    for name, why in choose_test_views(columns[0], key).items():
        looks = [render_view(one, views[name], key) for one in columns]
        found.append(Strip(name, why, fade_masked(views[name].image, np.isfinite(looks[0].error)), looks))
    return found


def render_view(one: Column, view: TrainingView, key: str) -> Look:
    """The view in a column, its colours corrected where its PSNR is that of corrected ones."""
    row = next(row for row in one.metrics["test_views"] if row["view"] == view.name)
    (view,) = mask_to_ground([view], one.grid)
    picture = np.clip(render(one.field, view.camera).colour, 0, 1)
    if key == "psnr_colour_corrected":
        picture = np.clip(metrics.correct_colours(picture, view.image, view.weight), 0, 1).astype(np.float32)
    counts = view.weight > 0
    error = np.where(counts, np.abs(picture - view.image).mean(-1), np.float32(np.nan))
    return Look(fade_masked(picture, counts), error, row)


def fade_masked(picture: Float32[Array, "h w 3"], counts: Array) -> Float32[Array, "h w 3"]:
    """The picture, nearly GREY where a pixel does not count."""
    grey = picture + np.float32(FADED) * (np.float32(GREY) - picture)
    return np.where(counts[..., None], picture, grey)


def error_limit(found: list[Strip]) -> float:
    """The error at which colours end, of all maps."""
    errors = np.concatenate([one.error[np.isfinite(one.error)] for strip in found for one in strip.looks])
    return float(np.quantile(errors, HIGHEST)) or 1.0


def draw_figure(found: list[Strip], columns: list[Column], key: str):
    """Of each view the photo and a render a column, under these maps of the error on one scale, under these the view's
    measures; under each column the photos that its fit had and its measures over all test views."""
    from matplotlib import colormaps
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import Normalize

    count = 1 + len(columns)
    side = WIDE / count
    tall = [side * strip.photo.shape[0] / strip.photo.shape[1] for strip in found for _ in range(2)]
    foot = FOOT + NOTE * any(one.note for one in columns)
    figure = figures.make_figure(
        WIDE, sum(tall) + HEAD + LABEL * len(found) + foot + KEY, w_pad=0.02, h_pad=0.02, hspace=0.0, wspace=0.0
    )
    grid = figure.subplots(len(tall) + 2, count, squeeze=False, height_ratios=[HEAD, *tall, foot])
    colours = {"norm": Normalize(0, error_limit(found)), "cmap": colormaps[MAP].with_extremes(bad=str(GREY))}
    for axes in grid.flat:
        axes.set(xticks=[], yticks=[])
        axes.spines[:].set_visible(False)
    for axes, title in zip(grid[0], ["photo", *(one.title for one in columns)], strict=True):
        _write_text(axes, title, size=12)
    for strip, pictures, maps in zip(found, grid[1:-1:2], grid[2:-1:2], strict=True):
        _draw_strip(strip, pictures, maps, colours, key)
    _draw_footer(grid[-1], columns, key)
    bar = figure.colorbar(
        ScalarMappable(**colours), ax=grid, location="bottom", extend="max", shrink=0.7, aspect=45, pad=0.01
    )
    bar.set_label("absolute error of colours in [0, 1]; grey: does not count", fontsize=11)
    bar.ax.tick_params(labelsize=11)
    return figure


def _draw_strip(strip: Strip, pictures, maps, colours: dict, key: str) -> None:
    pictures[0].imshow(strip.photo)
    _write_text(maps[0], f"{strip.name}:\n{strip.why}")
    for one, above, below in zip(strip.looks, pictures[1:], maps[1:], strict=True):
        above.imshow(one.picture)
        below.imshow(one.error, **colours)
        below.set_xlabel(_format_metrics(one.row, key), fontsize=11)


def _draw_footer(row, columns: list[Column], key: str) -> None:
    count = len(columns[0].metrics["test_views"])
    corrected = ",\nPSNR colour-corrected" if key == "psnr_colour_corrected" else ""
    _write_text(row[0], (f"mean of {count} test views" if count > 1 else "the one test view") + corrected)
    for axes, one in zip(row[1:], columns, strict=True):
        _write_text(
            axes, f"{one.metrics['photos']} photos\n{_format_metrics(one.metrics, key)}{one.note}", weight="bold"
        )


def _write_text(axes, text: str, **how) -> None:
    axes.text(0.5, 0.5, text, transform=axes.transAxes, ha="center", va="center", **({"size": 11} | how))


def _format_metrics(row: dict, key: str) -> str:
    psnr = "equal" if row[key] is None else f"{row[key]:.1f} dB"
    return f"{psnr}, SSIM {row['ssim']:.3f}"
