"""The report on a scene's photos: which were used, which were not and why, and what to photograph
next.

The page is one HTML file that loads nothing. The same photos/ folder and template give the same
bytes.
"""

import base64
import io
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from jaxtyping import Float
from matplotlib import colormaps
from matplotlib.patches import Rectangle
from numpy import ndarray as Array

from dav_gswt.files import atomic_file
from dav_gswt.geometry.cameras import Camera
from dav_gswt.geometry.scene_frame import SceneFrame, read_scene_frame
from dav_gswt.images import figures, image_files
from dav_gswt.logs import progress
from dav_gswt.photos import gaps, view_split
from dav_gswt.photos.colmap_model import (
    ColmapModel,
    count_shared_points,
    read_colmap_model,
    reprojection_errors,
    transform_model,
)
from dav_gswt.photos.ground_frame import Coverage, count_coverage
from dav_gswt.photos.sharpness import find_blurred
from dav_gswt.photos.view_split import find_aim_point
from dav_gswt.templates import render_template

LEAST_POINTS, LEAST_SHARE = 100, 0.2  # points that hold a photo: as a number, and as a share of the set's median
WORST_ERROR = 2.0  # pixels: a photo's mean error, above which its place is doubtful or its lens is another
LEAST_SIDE = 0.5  # flying heights: side of an exemplar with room for tiles that differ
TOO_FEW = 0.02  # share of the exemplar that may be seen by fewer photos than are needed
DOWN = 5.0  # degrees off straight down, within which a camera has no arrow
THUMBNAIL = 200  # pixels of the longer side
MASKED = np.array([0.85, 0.1, 0.5], np.float32)
FEW, MARK = "#b3471f", "#d55e00"  # colours of ground that too few photos see, and of photos that are weakly placed


@dataclass(frozen=True)
class ReportFacts:
    """A scene's photos.

    tests: names of those that only test. weak: reasons to doubt the place of others, by name. need: how many photos
    must see a place. cover: in world units, without test photos. error: mean reprojection error in pixels; None where
    it is unknown.
    """

    frame: SceneFrame
    model: ColmapModel
    tests: frozenset[str]
    weak: dict[str, list[str]]
    need: int
    cover: Coverage
    error: float | None


def write_report(folder: Path | str, template: Path | str, scene: str, out: Path | str) -> None:
    """Write the report on a photos/ folder (images/, sparse/, ground.json) to `out`.

    Raises: InputError: the folder is not readable, or the template uses a name that has no value.
    """
    found = collect_facts(folder)
    frame, names = found.frame, sorted(found.model.names, key=lambda name: name in found.tests)
    pictures = {name: make_thumbnail(Path(folder) / "images" / name) for name in progress(names, "shrink photos")}
    missed, blurred = find_missed_ground(found, Path(folder) / "images")
    values = {
        "scene": scene,
        "summary": _summarize(found),
        "advice": list_advice(found),
        "map": draw_map(found),
        "gaps": gaps.describe_ground(missed, frame) if missed else None,
        "gaps_map": encode_figure(gaps.draw_gaps(missed, found.model, frame, blurred)) if missed else None,
        "blurred": blurred,
        "horizon": missed.horizon if missed else (),
        "facts": _list_facts(found),
        "verdict": frame.verdict,
        "left_out": frame.left_out,
        "photos": pictures,
        "tests": found.tests,
        "weak": found.weak,
    }
    with atomic_file(out) as part:
        part.write_text(render_template(template, values), encoding="utf-8")


def collect_facts(folder: Path | str) -> ReportFacts:
    """The facts of a photos/ folder. Raises: InputError: what it holds is not readable."""
    folder = Path(folder)
    frame, model = read_scene_frame(folder / "ground.json"), read_colmap_model(folder / "sparse")
    tests, unit = frozenset(frame.test or ()), frame.flying_height
    flat = transform_model(model, 1 / unit, np.eye(3), np.zeros(3))
    cameras = tuple(c for name, c in zip(model.names, flat.cameras, strict=True) if name not in tests)
    empty = Coverage(0.0, 0.0, 1.0, np.zeros((1, 1), int))
    grid = count_coverage(cameras, flat.points) if len(flat.points) else empty
    cover = replace(grid, west=unit * grid.west, south=unit * grid.south, cell=unit * grid.cell)
    need = frame.photos_per_cell or (3 if len(cameras) >= 9 else 2)
    off = reprojection_errors(model)
    error = float(off.mean()) if frame.reprojection_error is None and len(off) else frame.reprojection_error
    return ReportFacts(frame, model, tests, find_weaknesses(model, off, tests), need, cover, error)


def find_missed_ground(found: ReportFacts, images: Path) -> tuple[gaps.Gaps | None, list[str]]:
    """The ground that all placed photos miss, None where no points are known; and the names of blurred photos."""
    names = found.model.names
    blurred = find_blurred([images / name for name in names], threads=1)
    blurred = [name for name, is_blurred in zip(names, blurred.tolist(), strict=True) if is_blurred]
    return gaps.find_gaps(found.model, found.frame, blurred) if len(found.model.points) else None, blurred


def find_weaknesses(model: ColmapModel, off: Float[Array, "m"], tests: frozenset[str]) -> dict[str, list[str]]:
    """What is weak about photos that do not only test, in words. off: reprojection errors of the observations."""
    shared = count_shared_points(model)
    points = np.diag(shared).copy()
    np.fill_diagonal(shared, 0)
    used = [i for i, name in enumerate(model.names) if name not in tests]
    usual = float(np.median(points[used])) if used else 0.0
    found = {}
    for i in used:
        own, said = off[model.image_of == i], []
        if points[i] < max(LEAST_POINTS, LEAST_SHARE * usual):
            said.append(f"sees only {points[i]} points; the median is {usual:.0f}")
        if len(own) and not own.mean() <= WORST_ERROR:
            said.append(f"its points are {own.mean():.1f} px off on average")
        if shared[i].max() < view_split.LINK:
            said.append(f"shares at most {shared[i].max()} points with any other photo")
        if said:
            found[model.names[i]] = said
    return found


def _summarize(found: ReportFacts) -> str:
    frame, side = found.frame, f"{found.frame.exemplar.side:.2f} {found.frame.unit}s"
    if frame.kind == "synthetic":
        tests, photos = len(found.tests), len(found.model.names)
        first = f"{photos - tests} photos were rendered, and {tests} for testing; their cameras are exact."
    else:
        first = f"{frame.registered} of {frame.images} photos were placed."
    return f"{first} Tiles are cut from a square of ground that is {side} wide, the exemplar (dashed on the map)."


def list_advice(found: ReportFacts) -> list[str]:
    """What is weak about the set, and what to do about it."""
    frame, said = found.frame, []
    if frame.verdict and frame.verdict.grade != "good":
        reasons = "; ".join(sign.reason for sign in frame.verdict.objections)
        said.append(f"The cameras are {frame.verdict.grade}: {reasons}.")
    if frame.left_out:
        said.append(
            f"{len(frame.left_out)} of {frame.images} photos were left out for the reasons below. Photos taken between "
            "them and the others can help."
        )
    if (share := measure_sparse_share(found)) > TOO_FEW:
        said.append(
            f"{100 * share:.0f} % of the exemplar is seen by fewer than {found.need} photos (brown on the map): take "
            "more photos of it."
        )
    if weak := list(found.weak):
        names = ", ".join(weak[:5]) + (f" and {len(weak) - 5} more" if len(weak) > 5 else "")
        said.append(f"Weakly placed photos: {names}. If the field looks blurred there, leave them out.")
    side = frame.exemplar.side / frame.flying_height
    if side < LEAST_SIDE:
        said.append(
            f"The exemplar is only {side:.2f} flying heights wide, so tiles repeat soon. Photograph more ground."
        )
    return said


def measure_sparse_share(found: ReportFacts) -> float:
    """The share of the exemplar that fewer photos see than are needed."""
    square, cover = found.frame.exemplar, found.cover
    rows, columns = cover.counts.shape
    y = cover.south + (np.arange(rows) + 0.5) * cover.cell
    x = cover.west + (np.arange(columns) + 0.5) * cover.cell
    counts = cover.counts[np.ix_((y > square.south) & (y < square.north), (x > square.west) & (x < square.east))]
    return float((counts < found.need).mean()) if counts.size else 1.0


def _list_facts(found: ReportFacts) -> list[tuple[str, str]]:
    """Numbers that help to judge the set: names and values."""
    frame, facts = found.frame, []
    if found.error is not None:
        facts.append(("Reprojection error", f"{found.error:.2f} px (good: below 1)"))
    if frame.focal:
        ratio = f"{frame.focal_ratio:.3f} times EXIF's; " if frame.focal_ratio else ""
        facts.append(("Focal length", ratio + frame.focal.decision))
    if frame.georeference:
        facts.append(("Place", f"{frame.georeference.latitude:.6f}, {frame.georeference.longitude:.6f}"))
    return facts


def draw_map(found: ReportFacts) -> str:
    """The coverage of the ground from above, with the exemplar and the cameras, as a data URI.

    Arrows point to where a camera looks. Weakly placed photos have their names, test photos are
    hollow.
    """
    frame, cover = found.frame, found.cover
    figure = figures.make_figure(8.0, 6.4)
    axes = figure.subplots()
    rows, columns = cover.counts.shape
    box = (cover.west, cover.west + columns * cover.cell, cover.south, cover.south + rows * cover.cell)
    counts, colours = np.ma.masked_equal(cover.counts, 0), colormaps["viridis"].with_extremes(under=FEW)
    shown = axes.imshow(counts, colours, extent=box, origin="lower", interpolation="nearest")
    shown.set_clim(found.need, max(int(cover.counts.max()), found.need + 1))
    figure.colorbar(
        shown, label=f"photos that see a place (at least {found.need} are needed)", shrink=0.7, extend="min"
    )
    square = frame.exemplar
    side = Rectangle((square.west, square.south), square.side, square.side, fill=False, ls="--", lw=1.5, ec="k")
    axes.add_patch(side)
    for name, camera in zip(found.model.names, found.model.cameras, strict=True):
        _draw_camera(axes, camera, MARK if name in found.weak else "k", name in found.tests, frame.flying_height)
        if name in found.weak:
            axes.annotate(name, tuple(camera.centre[:2]), (4, 4), textcoords="offset points", fontsize=7, color=MARK)
    if frame.georeference:
        gaps.draw_north(axes, frame.georeference)
    unit = "m" if frame.unit == "metre" else "flying heights"
    axes.set(xlabel=f"x, {unit}", ylabel=f"y, {unit}", aspect="equal")
    axes.autoscale()
    return encode_figure(figure)


def encode_figure(figure) -> str:
    """A figure as a PNG in a data URI."""
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
    return _encode_uri(figures.encode_jpeg(counts * small + (1 - counts) * (0.5 * small + 0.5 * MASKED), 80), "jpeg")


def _encode_uri(data: bytes, kind: str) -> str:
    return f"data:image/{kind};base64,{base64.b64encode(data).decode('ascii')}"
