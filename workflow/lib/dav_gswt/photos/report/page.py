"""The report on a scene's photos as one page that needs nothing else: what was found, what was left out, what is weak.

The page asks nothing of the net: pictures are data URIs, plans inline SVG. The same photos/ folder and template give
the same bytes.
"""

from html import escape
from pathlib import Path
from string import Template

import numpy as np

from dav_gswt.errors import InputError
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
from dav_gswt.photos.splitting import ground_bounds, measure_visible_share

SIGN = '<span class="sign" aria-hidden="true">⚠</span>'
Fact = tuple[str, str, str]  # its name, its value, what it means


def write_report(folder: Path | str, template: Path | str, scene: str, out: Path | str) -> None:
    """Write the report on a photos/ folder (images/, sparse/, ground.json) to `out`.

    Raises: InputError: the folder is not readable, or the template asks for what is not there.
    """
    found = collect_facts(folder, scene)
    smalls = make_thumbnails(Path(folder) / "images", [photo.name for photo in found.photos])
    page = Template(Path(template).read_text(encoding="utf-8"))
    try:
        text = page.substitute(parts(found, smalls))
    except (KeyError, ValueError) as error:
        raise InputError(f"{template}: not a template of this report ({error})") from error
    with atomic_file(out) as part:
        part.write_text(text, encoding="utf-8")


def parts(found: ReportFacts, smalls: list[Thumbnail]) -> dict[str, str]:
    """What the template's names stand for, as HTML."""
    photos = sorted(enumerate(zip(found.photos, smalls, strict=True)), key=lambda photo: photo[1][0].tests)
    return {
        "scene": escape(found.scene),
        "summary": escape(summary(found)),
        "verdict": verdict(found),
        "plan": draw_plan(found, smalls),
        "plan_notes": plan_notes(found),
        "coverage": draw_coverage(found),
        "bar": bar(found),
        "need": str(found.need),
        "facts": "\n".join(_fact(*fact) for fact in [*registration(found), *camera_facts(found), *masks(smalls)]),
        "left_out": left_out(found),
        "strip": "\n".join(_thumb(i, photo, small, found) for i, (photo, small) in photos),
        "rows": "\n".join(_row(i, photo, small.masked, found) for i, (photo, small) in photos),
        "height_unit": "m" if found.frame.unit == "metre" else "flying heights",
        "link": str(splitting.LINK),
    }


def summary(found: ReportFacts) -> str:
    """The page's first sentences."""
    frame, side = found.frame, found.length(found.exemplar[2])
    if frame.kind == "synthetic":
        tests = len(found.photos) - len(found.placed)
        first = f"{len(found.placed)} photos were rendered, and {tests} that only test; their cameras are exact."
    else:
        first = f"{frame.registered} of {frame.images} photos found their place over the ground."
    return f"{first} Tiles are made of a square of ground {side} wide: the exemplar, framed on both maps."


def verdict(found: ReportFacts) -> str:
    """The weak spots as a list, or that there are none."""
    spots = list_weak_spots(found)
    if not spots:
        good = "Nothing is weak: no photo, and no part of the exemplar."
        return f'<p class="fine"><span aria-hidden="true">✓</span> {good}</p>'
    items = "\n".join(f"<li>{SIGN} {escape(spot)}</li>" for spot in spots)
    return f'<ul class="spots">\n{items}\n</ul>'


def plan_notes(found: ReportFacts) -> str:
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
    return escape(" ".join(notes))


def bar(found: ReportFacts) -> str:
    """The coverage map's colours, each with its numbers of photos."""

    def item(low: int, high: int, colour: str) -> str:
        few = ' class="few"' if high < found.need else ""
        return f'<li{few} style="--colour: {colour}">{low if low == high else f"{low}–{high}"}</li>'

    return "\n".join(item(*found_bin) for found_bin in bin_coverage(found))


def registration(found: ReportFacts) -> list[Fact]:
    """How well the photos fit together."""
    frame, error = found.frame, mean_reprojection_error(found)
    counts = crop_to_exemplar(found)
    low, usual, high = min_median_max(counts.ravel()) if counts.size else (0, 0, 0)
    pairs = zip(found.photos, found.model.cameras, strict=True)
    sights = [
        measure_visible_share(camera, ground_bounds(frame, whole=False)) for photo, camera in pairs if not photo.tests
    ]
    sees = sum(sight >= splitting.LEAST_SIGHT for sight in sights)
    rest = "all of them" if sees == len(sights) else "the others show too little of it to take part"
    if frame.kind == "synthetic":
        first = ("Photos", f"{len(found.placed)} and {len(found.photos) - len(found.placed)} tests", "rendered")
    else:
        first = ("Photos in the folder", f"{frame.images}", f"{frame.registered} of them found their place")
    return [
        first,
        ("Photos of the exemplar", f"{sees}", rest),
        ("Photos of each place", f"{low:.0f} to {high:.0f}, mostly {usual:.0f}", "over the exemplar"),
        ("Points", f"{len(found.model.points):,}", "places on the ground that several photos agree on"),
        (
            "Reprojection error",
            "not known" if error is None else f"{error:.2f} px",
            "how far a point lies from where its photos show it: below 1 is good",
        ),
        ("Focal length", *focal_length(found)),
    ]


def focal_length(found: ReportFacts) -> tuple[str, str]:
    """The focal length over EXIF's, and what was decided about it."""
    frame, lens = found.frame, found.frame.focal
    if frame.kind == "synthetic":
        return "exact", "as rendered"
    ratio = frame.focal_ratio
    value = "EXIF has none" if ratio is None else f"{ratio:.3f} times EXIF's"
    if not lens:
        return (value, "as it was solved with") if ratio else ("as given", "from the model of another program")
    free = f"; the photos alone say {lens.free / lens.exif:.3f} times EXIF's" if lens.free and ratio else ""
    return value, f"{lens.decision}{free if 'alone' not in lens.decision else ''}"


def camera_facts(found: ReportFacts) -> list[Fact]:
    """Where the cameras are, and where the place is."""
    frame, cameras = found.frame, found.photos
    low, usual, high = min_median_max(np.array([c.height for c in cameras]))
    least, middle, most = min_median_max(np.array([c.tilt for c in cameras]))
    metric = frame.unit == "metre"
    flying = found.length(frame.flying_height) if metric else "the unit of length: metres are not known"
    facts = [
        ("Exemplar", found.length(found.exemplar[2]), "side of the square of ground that tiles are made of"),
        ("Flying height", flying, "median height of the cameras above the ground"),
        ("Heights", found.range(low, high), f"of the cameras; median {found.length(usual)}"),
        (
            "Tilt",
            f"{least:.0f} to {most:.0f} degrees",
            f"median {middle:.0f}; 0 looks straight down, 90 to the horizon",
        ),
    ]
    if frame.relief is not None:
        facts.append(("Relief", f"{frame.relief:.3f} flying heights", "how far points lie off the plane of the ground"))
    if found.place:
        where = f"{found.place.latitude:.6f}, {found.place.longitude:.6f}"
        turned = f"latitude and longitude of the origin; up on the maps is {found.place.north:.0f} degrees from north"
        return [*facts, ("Place", where, turned)]
    if frame.kind == "photos":
        facts.append(("Place", "not known", "the photos have no GPS positions, or none that agree with them"))
    return facts


def masks(smalls: list[Thumbnail]) -> list[Fact]:
    """How many photos are masked, and how much of them."""
    shares = [small.masked for small in smalls if small.masked > 0]
    if not shares:
        return []
    many = "1 photo" if len(shares) == 1 else f"{len(shares)} photos"
    return [("Masks", many, f"{100 * np.mean(shares):.1f} % does not count there (pink below)")]


def left_out(found: ReportFacts) -> str:
    """The photos that found no place, and why, as a section; nothing where all did."""
    if not (rows := found.frame.left_out):
        return ""
    body = "\n".join(f"<tr><th scope=row>{escape(r.name)}</th><td>{escape(r.reason)}</td></tr>" for r in rows)
    head = '<tr><th scope="col">Photo</th><th scope="col">Reason</th></tr>'
    return (
        f'<section id="left-out">\n<h2>Left out</h2>\n<div class="scroll"><table>\n<thead>{head}</thead>\n'
        f"<tbody>\n{body}\n</tbody></table></div>\n</section>"
    )


def _fact(name: str, value: str, meaning: str) -> str:
    return (
        f'<tr><th scope="row">{escape(name)}</th><td>{escape(value)}</td><td class="soft">{escape(meaning)}</td></tr>'
    )


def _thumb(index: int, photo: PhotoFacts, small: Thumbnail, found: ReportFacts) -> str:
    height, width = small.image.shape[:2]
    alt = f"Photo {photo.name}, {found.length(photo.height)} above the ground"
    sign = f"{SIGN} " if photo.weak else ""
    return (
        f'<li><a href="#photo-{index}"><img src="{small.uri}" width="{width}" height="{height}" alt="{escape(alt)}">'
        f"<span>{sign}{escape(photo.name)}</span></a></li>"
    )


def _row(index: int, photo: PhotoFacts, masked: float, found: ReportFacts) -> str:
    unit = "" if found.frame.unit == "flying height" else " m"
    if photo.partner:
        share = 100 * photo.shared / max(photo.points, 1)
        overlap = f"{photo.shared:,} with {photo.partner} ({share:.0f} %), {photo.linked} linked"
    else:
        overlap = "–"
    notes = [*photo.weak] or ["only tests" if photo.tests else "good"]
    notes += [f"{100 * masked:.0f} % masked"] if masked > 0 else []
    cells = [
        f"{photo.points:,}",
        "–" if photo.error is None else f"{photo.error:.2f}",
        f"{photo.height:.2f}{unit}",
        f"{photo.tilt:.0f}",
    ]
    numbers = "".join(f'<td class="number">{escape(cell)}</td>' for cell in cells)
    said = f"{SIGN if photo.weak else ''} {escape('; '.join(notes))}".strip()
    kind = ' class="weak"' if photo.weak else ""
    return (
        f'<tr id="photo-{index}"{kind}><th scope="row">{escape(photo.name)}</th>{numbers}'
        f"<td>{escape(overlap)}</td><td>{said}</td></tr>"
    )
