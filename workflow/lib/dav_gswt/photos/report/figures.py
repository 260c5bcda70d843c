"""The report's pictures: a plan of the cameras over the ground, a map of how often it is seen, and thumbnails.

Plans are inline SVG over small pictures; their units are thousandths of the longer side.
"""

import base64
import io
from dataclasses import dataclass
from html import escape
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Float, Float32, UInt8
from matplotlib import colormaps
from matplotlib.colors import to_hex
from matplotlib.image import imsave
from numpy import ndarray as Array

from dav_gswt.geometry.cameras import Camera
from dav_gswt.images import image_files
from dav_gswt.logs import progress
from dav_gswt.photos import ground_frame
from dav_gswt.photos.colmap_model import ColmapModel
from dav_gswt.photos.report.facts import PhotoFacts, ReportFacts
from dav_gswt.photos.splitting import find_aim_point

LONGER = 1000.0  # of a plan's sides, in its own units
DOTS = 600  # pixels of the longer side of the points' picture
DENSE = 10_000  # points, from which on each is drawn 3 pixels wide, else 5
AROUND = 0.04  # margin of a plan, as a share of its longer side
DOWN = 5.0  # degrees off straight down, within which a camera has no arrow
THUMB, MANY, SMALLER = 240, 120, 160  # pixels of a thumbnail's longer side; from this many photos on they are smaller
BINS = 5  # most colours of the coverage map
MASKED = np.array([0.85, 0.1, 0.5], np.float32)
FEW = ("#b3471f", "#e08a3c")  # colours where too few photos see the ground
STEPS = np.array([1, 2, 2.5, 5, 10])  # a scale bar's round lengths


@dataclass(frozen=True)
class Thumbnail:
    """A photo in small. uri: with what is masked in pink. masked: the share that is."""

    image: Float32[Array, "h w 3"]
    uri: str
    masked: float


class CoverageBin(NamedTuple):
    """Numbers of photos that share a colour of the coverage map."""

    first: int
    last: int
    colour: str


@dataclass(frozen=True)
class MapSheet:
    """A piece of the world on paper, north up. per_unit: units of the drawing to one of the world."""

    west: float
    north: float
    width: float
    height: float
    per_unit: float

    def at(self, places: Float[Array, "n d"]) -> Float[Array, "n 2"]:
        """Where places of the world lie on the sheet."""
        return (np.asarray(places, float)[:, :2] - [self.west, self.north]) * [self.per_unit, -self.per_unit]


def make_sheet(found: ReportFacts) -> MapSheet:
    """Room for the ground that photos see, the exemplar and all cameras."""
    west, south, side = found.exemplar
    extent = found.frame.extent
    corners = [[extent.west, extent.south], [extent.east, extent.north]]
    corners += [[west, south], [west + side, south + side], *(c.centre[:2] for c in found.model.cameras)]
    low, high = np.min(corners, axis=0), np.max(corners, axis=0)
    margin = AROUND * float((high - low).max())
    low, high = low - margin, high + margin
    scale = LONGER / float((high - low).max())
    width, height = scale * (high - low)
    return MapSheet(float(low[0]), float(high[1]), float(width), float(height), scale)


def draw_plan(found: ReportFacts, smalls: list[Thumbnail]) -> str:
    """Cameras over the points, each with its footprint, as SVG."""
    on = make_sheet(found)
    shots = zip(found.photos, found.model.cameras, strict=True)
    drawn = [_draw_camera(i, photo, camera, found, on) for i, (photo, camera) in enumerate(shots)]
    ground_picture = draw_points(found.model, average_colours(found.model, smalls), on)
    layers = [
        _format_picture(ground_picture, 0.0, 0.0, on.width, on.height),
        _draw_exemplar(found, on),
        *drawn,
        _draw_scale_and_north(found, on),
    ]
    return _format_svg("Plan: cameras over the ground, seen from above", on, layers)


def draw_coverage(found: ReportFacts) -> str:
    """How many photos see each place, as SVG."""
    on, cover = make_sheet(found), found.cover
    rows, columns = cover.counts.shape
    (x, y), *_ = on.at(np.array([[cover.west, cover.south + rows * cover.cell]]))
    size = columns * cover.cell * on.per_unit, rows * cover.cell * on.per_unit
    painted = np.zeros((rows, columns, 4), np.uint8)
    for low, high, colour in bin_coverage(found):
        mask = (cover.counts >= low) & (cover.counts <= high)
        painted[mask] = [*(int(colour[k : k + 2], 16) for k in (1, 3, 5)), 255]
    layers = [
        _format_picture(painted[::-1], float(x), float(y), *size, kind="cells"),
        _draw_exemplar(found, on),
        _draw_scale_and_north(found, on),
    ]
    return _format_svg("Coverage: how many photos see each place of the ground", on, layers)


def bin_coverage(found: ReportFacts) -> list[CoverageBin]:
    """The colours of the coverage map. Numbers of photos below what is needed stand out."""
    most = max(int(found.cover.counts.max()), found.need)
    few = [CoverageBin(n, n, FEW[0] if n == 1 and found.need > 2 else FEW[1]) for n in range(1, found.need)]
    step = -(-(most - found.need + 1) // BINS)
    starts = range(found.need, most + 1, step)
    scale = colormaps["viridis"]
    enough = [
        CoverageBin(n, min(n + step - 1, most), to_hex(scale(0.2 + 0.8 * i / len(starts))))
        for i, n in enumerate(starts)
    ]
    return few + enough


def camera_footprint(camera: Camera, reach: float, along: int = 8) -> Float[Array, "n 2"]:
    """The outline on z = 0 of what a camera sees, no farther than `reach` from it; `along`: corners a side.

    Rays that meet the plane beyond, or never, end above the point at that distance.
    """
    t = np.arange(along) / along
    u = np.concatenate([t, np.ones(along), 1 - t, np.zeros(along)]) * camera.width
    v = np.concatenate([np.zeros(along), t, np.ones(along), 1 - t]) * camera.height
    rays = np.stack([(u - camera.cx) / camera.fx, (v - camera.cy) / camera.fy, np.ones(len(u))], 1) @ camera.rotation
    rays /= np.linalg.norm(rays, axis=1, keepdims=True)
    centre = camera.centre
    far = np.where(rays[:, 2] < 0, centre[2] / np.maximum(-rays[:, 2], 1e-12), np.inf)
    return centre[:2] + np.minimum(far, reach)[:, None] * rays[:, :2]


def average_colours(model: ColmapModel, smalls: list[Thumbnail]) -> Float32[Array, "n 3"]:
    """The points' mean colours over the photos that see them: the model's own may be grey."""
    total = np.zeros((len(model.points), 3))
    for i, (camera, small) in enumerate(zip(model.cameras, smalls, strict=True)):
        own = model.image_of == i
        height, width = small.image.shape[:2]
        at = (model.pixels[own] * [width / camera.width, height / camera.height]).astype(int)
        column, row = np.clip(at, 0, [width - 1, height - 1]).T
        np.add.at(total, model.point_of[own], small.image[row, column])
    seen = np.bincount(model.point_of, minlength=len(model.points))
    return (total / np.maximum(seen, 1)[:, None]).astype(np.float32)


def draw_points(model: ColmapModel, colour: Float32[Array, "n 3"], on: MapSheet) -> UInt8[Array, "h w 4"]:
    """The sparse points, the higher over the lower."""
    scale = DOTS / LONGER
    width, height = (max(1, round(scale * side)) for side in (on.width, on.height))
    wide = 3 if len(model.points) >= DENSE else 5
    picture = np.zeros((height + wide - 1, width + wide - 1, 4), np.uint8)
    order = np.argsort(model.points[:, 2], kind="stable")
    column, row = np.floor(on.at(model.points[order]) * scale).astype(int).T
    inside = (row >= 0) & (row < height) & (column >= 0) & (column < width)
    painted = np.c_[np.rint(255 * colour[order]), np.full(len(order), 255)].astype(np.uint8)[inside]
    for i in range(wide):
        for j in range(wide):
            picture[row[inside] + i, column[inside] + j] = painted
    return picture[wide // 2 :, wide // 2 :][:height, :width]


def make_thumbnail(path: Path, longer: int) -> Thumbnail:
    """A picture at most `longer` pixels wide or high."""
    image, cover = image_files.read_photo_and_alpha(path)
    small, counts = (image_files.shrink_to(part, longer) for part in (image, cover[..., None]))
    shown = counts * small + (1 - counts) * (0.5 * small + 0.5 * MASKED)
    return Thumbnail(small, encode_data_uri(shown, "jpeg"), float(1 - cover.mean()))


def make_thumbnails(folder: Path, names: list[str]) -> list[Thumbnail]:
    """Photos in small, smaller ones of many."""
    longer = THUMB if len(names) < MANY else SMALLER
    return [make_thumbnail(folder / name, longer) for name in progress(names, "shrink photos")]


def encode_data_uri(picture: Array, kind: str) -> str:
    """A picture as a data URI: bytes that depend on its pixels alone."""
    file = io.BytesIO()
    pixels = picture if picture.dtype == np.uint8 else np.rint(255 * np.clip(picture, 0, 1)).astype(np.uint8)
    options: dict[str, Any] = {"metadata": {"Software": None}} if kind == "png" else {"pil_kwargs": {"quality": 80}}
    imsave(file, np.ascontiguousarray(pixels), format=kind, **options)
    return f"data:image/{kind};base64,{base64.b64encode(file.getvalue()).decode('ascii')}"


def _format_svg(label: str, on: MapSheet, layers: list[str]) -> str:
    inside = "\n".join(layers)
    return (
        f'<svg viewBox="0 0 {on.width:.1f} {on.height:.1f}" role="group" aria-label="{escape(label)}">\n'
        f'<rect class="paper" width="{on.width:.1f}" height="{on.height:.1f}"/>\n{inside}\n</svg>'
    )


def _format_picture(
    pixels: UInt8[Array, "h w 4"], x: float, y: float, width: float, height: float, kind: str = "points"
) -> str:
    place = f'x="{x:.1f}" y="{y:.1f}" width="{width:.1f}" height="{height:.1f}"'
    return f'<image class="{kind}" {place} preserveAspectRatio="none" href="{encode_data_uri(pixels, "png")}"/>'


def _draw_exemplar(found: ReportFacts, on: MapSheet) -> str:
    west, south, side = found.exemplar
    ((x, y),) = on.at(np.array([[west, south + side]]))
    length = side * on.per_unit
    box = f'x="{x:.1f}" y="{y:.1f}" width="{length:.1f}" height="{length:.1f}"'
    said = f"The exemplar: {found.length(side)} wide"
    return f'<rect class="halo" {box}/><rect class="exemplar" {box}><title>{escape(said)}</title></rect>'


def _draw_camera(index: int, photo: PhotoFacts, camera: Camera, found: ReportFacts, on: MapSheet) -> str:
    """A camera: its footprint, an arrow to where it looks, and a dot that leads to its row."""
    unit = found.frame.flying_height
    outline = " ".join(f"{x:.1f},{y:.1f}" for x, y in on.at(camera_footprint(camera, ground_frame.REACH * unit)))
    ((x, y),) = on.at(camera.centre[None])
    kind = "shot weak" if photo.weak else "shot test" if photo.tests else "shot"
    said = f"{photo.name}: {found.length(photo.height)} high, {photo.tilt:.0f} degrees off straight down"
    said += "".join(f"; {text}" for text in photo.weak) + ("; only tests" if photo.tests else "")
    return (
        f'<a href="#photo-{index}" class="{kind}" aria-label="{escape(said)}"><title>{escape(said)}</title>'
        f'<polygon class="foot" points="{outline}"/>{_draw_arrow(photo, camera, unit, on)}'
        f'<circle cx="{x:.1f}" cy="{y:.1f}" r="9"/></a>'
    )


def _draw_arrow(photo: PhotoFacts, camera: Camera, unit: float, on: MapSheet) -> str:
    """From the camera towards where the middle of its picture lies, at most half a flying height long."""
    start, ahead = camera.centre[:2], camera.forward[:2]
    if photo.tilt < DOWN:
        return ""
    aim = find_aim_point(camera) - start if camera.forward[2] <= -0.1 else ahead / np.linalg.norm(ahead) * unit
    aim *= min(1.0, 0.5 * unit / max(float(np.linalg.norm(aim)), 1e-12))
    (x, y), (u, v) = on.at(np.stack([start, start + aim]))
    length = max(float(np.hypot(u - x, v - y)), 24.0)
    turn = np.degrees(np.arctan2(v - y, u - x))
    head = f"M{length - 15:.1f},-8 L{length:.1f},0 L{length - 15:.1f},8 Z"
    return (
        f'<g transform="translate({x:.1f} {y:.1f}) rotate({turn:.1f})">'
        f'<path class="line" d="M0,0 L{length - 12:.1f},0"/><path class="head" d="{head}"/></g>'
    )


def _draw_scale_and_north(found: ReportFacts, on: MapSheet) -> str:
    """A scale bar, and where north is if that is known."""
    target = 0.2 * on.width / on.per_unit
    tens = 10 ** np.floor(np.log10(target))
    length = float(tens * STEPS[STEPS * tens <= target * 1.0001].max())
    name = f"{length:g} flying height{'' if length == 1 else 's'}" if found.frame.unit == "flying height" else ""
    x, y, end = 24.0, on.height - 24, 24 + length * on.per_unit
    bar = f'<path class="bar" d="M{x},{y - 10:.1f} V{y:.1f} H{end:.1f} V{y - 10:.1f}"/>'
    text = f'<text x="{x}" y="{y - 18:.1f}">{name or f"{length:g} m"}</text>'
    if not found.place:
        return bar + text
    needle = '<path class="needle" d="M0,-38 L12,14 L0,6 L-12,14 Z"/><text y="-46" text-anchor="middle">N</text>'
    turn = f"translate({on.width - 60:.1f} 90) rotate({-found.place.north:.1f})"
    return f'{bar}{text}<g transform="{turn}">{needle}</g>'
