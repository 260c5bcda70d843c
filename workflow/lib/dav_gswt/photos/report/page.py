"""The report on a scene's photos: one HTML page with the registration, the photos left out, and the weak ones.

The page loads nothing: pictures are data URIs, plans are inline SVG. The same photos/ folder and template give the same
bytes.
"""

from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np
from markupsafe import Markup

from dav_gswt.files import atomic_file
from dav_gswt.photos import splitting
from dav_gswt.photos.report import figures
from dav_gswt.photos.report.facts import (
    PhotoFacts,
    ReportFacts,
    collect_facts,
    crop_to_exemplar,
    list_weak_spots,
    mean_reprojection_error,
    min_median_max,
)
from dav_gswt.photos.report.figures import Thumbnail, bin_coverage, draw_coverage, draw_plan, make_thumbnails
from dav_gswt.photos.report.mosaic import GroundKinds, Segment, find_kinds
from dav_gswt.photos.splitting import ground_bounds, measure_visible_share, shows_enough
from dav_gswt.templates import render_template


class Fact(NamedTuple):
    """A row of the table of facts."""

    name: str
    value: str
    meaning: str


@dataclass(frozen=True)
class PhotoRow:
    """A photo as the page lists it. numbers: points, error, height and tilt, as text. weak: has a weakness."""

    index: int
    name: str
    uri: str
    width: int
    height: int
    above_ground: str
    weak: bool
    numbers: tuple[str, ...]
    overlap: str
    verdict: str


def write_report(folder: Path | str, template: Path | str, scene: str, out: Path | str, segment: Segment) -> None:
    """Write the report on a photos/ folder (images/, sparse/, ground.json) to `out`.

    segment: tells kinds of ground apart, see `mosaic.find_kinds`.
    Raises: InputError: the folder is not readable, or the template asks for what is not there.
    """
    found = collect_facts(folder, scene)
    thumbnails = make_thumbnails(Path(folder) / "images", [photo.name for photo in found.photos])
    kinds = find_kinds(Path(folder) / "images", found, segment)
    text = render_template(template, make_template_values(found, thumbnails, kinds))
    with atomic_file(out) as part:
        part.write_text(text, encoding="utf-8")


def make_template_values(
    found: ReportFacts, thumbnails: list[Thumbnail], kinds: GroundKinds | None
) -> dict[str, object]:
    """What the template's names stand for. Photos that only test come last."""
    rows = [_make_photo_row(i, *pair, found) for i, pair in enumerate(zip(found.photos, thumbnails, strict=True))]
    return {
        "scene": found.scene,
        "summary": summarize(found),
        "weak_spots": list_weak_spots(found),
        "plan": Markup(draw_plan(found, thumbnails)),
        "plan_notes": explain_plan(found),
        "coverage": Markup(draw_coverage(found)),
        "bins": bin_coverage(found),
        "need": found.need,
        "facts": [*list_registration_facts(found), *list_camera_facts(found), *list_mask_facts(thumbnails)],
        "kinds": describe_kinds(kinds),
        "kinds_picture": figures.encode_data_uri(kinds.picture, "png") if kinds else None,
        "verdict": found.frame.verdict,
        "left_out": found.frame.left_out,
        "photos": sorted(rows, key=lambda row: found.photos[row.index].tests),
        "height_unit": "m" if found.frame.unit == "metre" else "flying heights",
        "link": splitting.LINK,
    }


def summarize(found: ReportFacts) -> str:
    """The page's first sentences."""
    frame, side = found.frame, found.length(found.exemplar[2])
    if frame.kind == "synthetic":
        tests = len(found.photos) - len(found.placed)
        first = f"{len(found.placed)} photos were rendered, and {tests} that only test; their cameras are exact."
    else:
        first = f"{frame.registered} of {frame.images} photos found their place over the ground."
    return f"{first} Tiles are made of a square of ground {side} wide: the exemplar, framed on both maps."


def describe_kinds(kinds: GroundKinds | None) -> str:
    """What the ground consists of, and what that means for tiles, in sentences."""
    if kinds is None:
        return "No photo looks down at the exemplar, so the kinds of its ground are not known before it is fitted."
    if len(kinds.shares) < 2:
        return "The ground looks like one material: its tiles are cut from all of it."
    shares = ", ".join(f"{100 * share:.0f} %" for share in kinds.shares)
    return (
        f"The ground is mixed: it has {len(kinds.shares)} kinds that look unlike ({shares} of the exemplar). Tiles of "
        "all of it as one texture would repeat its borders. With `materials: auto` those that are wide enough get "
        "tiles of their own; the report on materials, made after the fit, has the verdict."
    )


def explain_plan(found: ReportFacts) -> str:
    """What the plan's signs mean, as far as it has them."""
    notes = ["Each dot is a camera. Point at it for its name and what it sees (thin outline); select it for its row."]
    if any(photo.tilt >= figures.DOWN for photo in found.photos):
        notes.append("Arrows point to where it looks; a camera without one looks straight down.")
    else:
        notes.append("All look nearly straight down.")
    if any(photo.weak for photo in found.photos):
        notes.append("Orange: weakly placed.")
    if any(photo.tests for photo in found.photos):
        notes.append("Hollow: it only tests.")
    notes.append("Behind them are the points that the photos agree on, in their colours. Dashed square: the exemplar.")
    return " ".join(notes)


def list_registration_facts(found: ReportFacts) -> list[Fact]:
    """How well the photos fit together."""
    frame, error = found.frame, mean_reprojection_error(found)
    counts = crop_to_exemplar(found)
    low, usual, high = min_median_max(counts.ravel()) if counts.size else (0, 0, 0)
    pairs, bounds = zip(found.photos, found.model.cameras, strict=True), ground_bounds(frame, whole=False)
    cameras = [camera for photo, camera in pairs if not photo.tests]
    shares = [measure_visible_share(camera, bounds) for camera in cameras]
    count = sum(shows_enough(camera, bounds) for camera in cameras)
    others = "all of them" if count == len(shares) else "the others show too little of it to take part"
    if frame.kind == "synthetic":
        first = Fact("Photos", f"{len(found.placed)} and {len(found.photos) - len(found.placed)} tests", "rendered")
    else:
        first = Fact("Photos in the folder", f"{frame.images}", f"{frame.registered} of them found their place")
    return [
        first,
        Fact("Photos of the exemplar", f"{count}", others),
        Fact("Photos of each place", f"{low:.0f} to {high:.0f}, mostly {usual:.0f}", "over the exemplar"),
        Fact("Points", f"{len(found.model.points):,}", "places on the ground that several photos agree on"),
        Fact(
            "Reprojection error",
            "not known" if error is None else f"{error:.2f} px",
            "how far a point lies from where its photos show it: below 1 is good",
        ),
        Fact("Focal length", *describe_focal_length(found)),
    ]


def describe_focal_length(found: ReportFacts) -> tuple[str, str]:
    """The focal length over EXIF's, and what was decided about it."""
    frame, lens = found.frame, found.frame.focal
    if frame.kind == "synthetic":
        return "exact", "as rendered"
    ratio = frame.focal_ratio
    value = "EXIF has none" if ratio is None else f"{ratio:.3f} times EXIF's"
    if not lens:
        return (value, "as it was solved with") if ratio else ("as given", "from the model of another program")
    free = (
        f"; the photos alone say {lens.free / lens.exif:.3f} times EXIF's" if lens.free and lens.exif and ratio else ""
    )
    return value, f"{lens.decision}{free if 'alone' not in lens.decision else ''}"


def list_camera_facts(found: ReportFacts) -> list[Fact]:
    """Where the cameras are, and where the place is."""
    frame, cameras = found.frame, found.photos
    low, usual, high = min_median_max(np.array([c.height for c in cameras]))
    least, middle, most = min_median_max(np.array([c.tilt for c in cameras]))
    metric = frame.unit == "metre"
    flying = found.length(frame.flying_height) if metric else "the unit of length: metres are not known"
    facts = [
        Fact("Exemplar", found.length(found.exemplar[2]), "side of the square of ground that tiles are made of"),
        Fact("Flying height", flying, "median height of the cameras above the ground"),
        Fact("Heights", found.range(low, high), f"of the cameras; median {found.length(usual)}"),
        Fact(
            "Tilt",
            f"{least:.0f} to {most:.0f} degrees",
            f"median {middle:.0f}; 0 looks straight down, 90 to the horizon",
        ),
    ]
    if frame.relief is not None:
        facts.append(
            Fact("Relief", f"{frame.relief:.3f} flying heights", "how far points lie off the plane of the ground")
        )
    if found.place:
        where = f"{found.place.latitude:.6f}, {found.place.longitude:.6f}"
        turned = f"latitude and longitude of the origin; up on the maps is {found.place.north:.0f} degrees from north"
        return [*facts, Fact("Place", where, turned)]
    if frame.kind == "photos":
        facts.append(Fact("Place", "not known", "the photos have no GPS positions, or none that agree with them"))
    return facts


def list_mask_facts(thumbnails: list[Thumbnail]) -> list[Fact]:
    """How many photos are masked, and how much of them."""
    shares = [thumbnail.masked for thumbnail in thumbnails if thumbnail.masked > 0]
    if not shares:
        return []
    many = "1 photo" if len(shares) == 1 else f"{len(shares)} photos"
    return [Fact("Masks", many, f"{100 * np.mean(shares):.1f} % does not count there (pink below)")]


def _make_photo_row(index: int, photo: PhotoFacts, thumbnail: Thumbnail, found: ReportFacts) -> PhotoRow:
    unit = "" if found.frame.unit == "flying height" else " m"
    overlap = "–"
    if photo.partner:
        share = 100 * photo.shared / max(photo.points, 1)
        overlap = f"{photo.shared:,} with {photo.partner} ({share:.0f} %), {photo.linked} linked"
    notes = [*photo.weak] or ["only tests" if photo.tests else "good"]
    notes += [f"{100 * thumbnail.masked:.0f} % masked"] if thumbnail.masked > 0 else []
    error = "–" if photo.error is None else f"{photo.error:.2f}"
    height, width = thumbnail.image.shape[:2]
    return PhotoRow(
        index=index,
        name=photo.name,
        uri=thumbnail.uri,
        width=width,
        height=height,
        above_ground=found.length(photo.height),
        weak=bool(photo.weak),
        numbers=(f"{photo.points:,}", error, f"{photo.height:.2f}{unit}", f"{photo.tilt:.0f}"),
        overlap=overlap,
        verdict="; ".join(notes),
    )
