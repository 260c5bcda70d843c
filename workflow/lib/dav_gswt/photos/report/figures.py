"""The report's pictures: a map of the cameras over the coverage of the ground, and thumbnails, as data URIs."""

import base64
import io
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import Float
from matplotlib import colormaps
from matplotlib.colors import BoundaryNorm, ListedColormap
from matplotlib.patches import Rectangle
from numpy import ndarray as Array

from dav_gswt.geometry.cameras import Camera
from dav_gswt.images import figures, image_files
from dav_gswt.images.figures import encode_jpeg
from dav_gswt.photos.view_split import find_aim_point

if TYPE_CHECKING:
    from dav_gswt.photos.report.page import ReportFacts

DOWN = 5.0  # degrees off straight down, within which a camera has no arrow
THUMBNAIL = 200  # pixels of the longer side
MASKED = np.array([0.85, 0.1, 0.5], np.float32)
FEW, MARK = "#b3471f", "#d55e00"  # colours of ground that too few photos see, and of photos that are weakly placed
MOST_COLOURS = 6


def draw_map(found: "ReportFacts") -> str:
    """The coverage of the ground from above, with the exemplar and the cameras, as a data URI.

    Arrows point to where a camera looks. Weakly placed photos have their names, test photos are
    hollow.
    """
    frame, cover = found.frame, found.cover
    figure = figures.make_figure(8.0, 6.4)
    axes = figure.subplots()
    rows, columns = cover.counts.shape
    box = (cover.west, cover.west + columns * cover.cell, cover.south, cover.south + rows * cover.cell)
    most = max(int(cover.counts.max()), found.need)
    bounds = np.unique(np.linspace(found.need, most + 1, MOST_COLOURS + 1).astype(int))
    colours = [FEW, *colormaps["viridis"](np.linspace(0.25, 1, len(bounds) - 1))]
    norm = BoundaryNorm([1, *bounds], len(colours))  # at least two photos are needed
    counts = np.ma.masked_equal(cover.counts, 0)
    shown = axes.imshow(counts, ListedColormap(colours), norm, extent=box, origin="lower", interpolation="nearest")
    figure.colorbar(shown, label=f"photos that see a place (at least {found.need} are needed)", shrink=0.7)
    square = frame.exemplar
    side = Rectangle((square.west, square.south), square.side, square.side, fill=False, ls="--", lw=1.5, ec="k")
    axes.add_patch(side)
    for photo, camera in zip(found.photos, found.model.cameras, strict=True):
        _draw_camera(axes, camera, MARK if photo.weak else "k", photo.tests, frame.flying_height)
        if photo.weak:
            axes.annotate(
                photo.name, tuple(camera.centre[:2]), (4, 4), textcoords="offset points", fontsize=7, color=MARK
            )
    if frame.georeference:
        turn = np.radians(frame.georeference.north)
        tip = np.array([0.93, 0.93]) + 0.07 * np.array([-np.sin(turn), np.cos(turn)])
        arrow = {"arrowstyle": "<-"}
        axes.annotate("N", (0.93, 0.93), tuple(tip), "axes fraction", "axes fraction", arrow, ha="center", va="center")
    unit = "m" if frame.unit == "metre" else "flying heights"
    axes.set(xlabel=f"x, {unit}", ylabel=f"y, {unit}", aspect="equal")
    axes.autoscale()
    file = io.BytesIO()
    figure.savefig(file, format="png", metadata={"Software": None})
    return _encode_uri(file.getvalue(), "png")


def _draw_camera(axes, camera: Camera, colour: str, hollow: bool, unit: float) -> None:
    """A dot, and an arrow of at most half a flying height to where the middle of the picture looks."""
    start, ahead = camera.centre[:2], find_aim_point(camera) - camera.centre[:2]
    if camera.forward[2] > -0.1:  # it looks to the horizon
        ahead = unit * camera.forward[:2]
    if -camera.forward[2] < np.cos(np.radians(DOWN)):
        ahead = ahead * min(1.0, 0.5 * unit / max(float(np.linalg.norm(ahead)), 1e-12))
        axes.annotate("", start + ahead, start, arrowprops={"arrowstyle": "->", "color": colour, "shrinkA": 0})
    axes.plot(*start, "o", ms=5, color=colour, mfc="w" if hollow else colour)


def make_thumbnail(path: Path) -> str:
    """A small picture as a data URI, what is masked in pink."""
    image, cover = image_files.read_photo_and_alpha(path)
    small, counts = (image_files.shrink_to(part, THUMBNAIL) for part in (image, cover[..., None]))
    return _encode_uri(encode_jpeg(_tint(small, counts), 80), "jpeg")


def _tint(image: Float[Array, "h w 3"], counts: Float[Array, "h w 1"]) -> Float[Array, "h w 3"]:
    return counts * image + (1 - counts) * (0.5 * image + 0.5 * MASKED)


def _encode_uri(data: bytes, kind: str) -> str:
    return f"data:image/{kind};base64,{base64.b64encode(data).decode('ascii')}"
