"""The shot list as a web page without scripts or network access, to be opened from a file on a phone."""

from dataclasses import dataclass
from html import escape
from pathlib import Path
from string import Template

import numpy as np
from jaxtyping import Float32
from numpy import ndarray as Array

from dav_gswt.capture import directions, shot_list_map
from dav_gswt.capture.directions import Ruler
from dav_gswt.field import GaussianField
from dav_gswt.geometry.cameras import Camera
from dav_gswt.geometry.scene_frame import SceneFrame
from dav_gswt.images import image_files
from dav_gswt.raster import render

LONGER = 720  # pixels of an expected picture's longer side
ZENITH, HORIZON = np.array([0.42, 0.6, 0.85]), np.array([0.85, 0.9, 0.95])
GROUND = np.array([0.5, 0.5, 0.5])  # where the ground is not known
CLOSE, TURNED = 0.2, 15  # flying heights, degrees: a photo nearer than this to its pose is always assigned to it


@dataclass(frozen=True)
class Station:
    """A place to take photos at. photos: how many are missing."""

    name: str
    camera: Camera
    photos: int


@dataclass(frozen=True)
class ShotList:
    """Header of a shot list. drop: folder for the photos. length: of the walk, in world units."""

    scene: str
    frame: SceneFrame
    ruler: Ruler
    drop: Path
    length: float


def write_page(folder: Path, shot_list: ShotList, stations: list[Station], field: GaussianField | None) -> None:
    """Write index.html, map.png and, if there is a field, the expected picture of every station."""
    by = shot_list.ruler
    drawn = shot_list_map.draw_map([station.camera for station in stations], shot_list.frame, by, field)
    image_files.write_png(folder / "map.png", drawn.picture)
    cards = []
    for i, station in enumerate(stations):
        if field is not None:
            image_files.write_png(folder / _picture_name(i), render_expected(field, station.camera))
        before = stations[i - 1].camera if i else None
        cards.append(_format_card(i, station, before, shot_list, field is not None))
    photos = sum(station.photos for station in stations)
    text = PAGE.substitute(
        scene=escape(shot_list.scene),
        summary=_format_summary(photos, len(stations), shot_list),
        unit=_explain_unit(by),
        picture=PICTURE if field is not None else "",
        near=f"{by.format_length(CLOSE * by.unit)} and {TURNED} degrees",
        drop=escape(str(shot_list.drop)),
        width=drawn.camera.width,
        height=drawn.camera.height,
        drawing=drawn.drawing,
        cards="\n".join(cards),
    )
    (folder / "index.html").write_text(text, encoding="utf-8")


def render_expected(field: GaussianField, camera: Camera) -> Float32[Array, "h w 3"]:
    """Render the field over a sky and a ground of its mean colour."""
    scale = LONGER / max(camera.width, camera.height)
    view = camera.resized(max(round(camera.width * scale), 16), max(round(camera.height * scale), 16))
    seen = render(field, view)
    return np.clip(seen.colour + (1 - seen.alpha)[..., None] * _backdrop(view, field), 0, 1)


def _backdrop(camera: Camera, field: GaussianField) -> Float32[Array, "h w 3"]:
    step = camera.rays()[1]
    rise = (step[..., 2] / np.linalg.norm(step, axis=-1))[..., None]
    sky = HORIZON + (ZENITH - HORIZON) * np.clip(rise, 0, 1) ** 0.5
    ground = field.base_colours[field.ground]
    below = np.clip(ground.mean(0), 0, 1) if len(ground) else GROUND
    return np.where(rise > 0, sky, below).astype(np.float32)


def _picture_name(i: int) -> str:
    return f"place_{i + 1:03d}.png"


def _format_count(many: int, of: str) -> str:
    return f"{many} {of}" if many == 1 else f"{many} {of}s"


def _format_summary(photos: int, places: int, shot_list: ShotList) -> str:
    by, length = shot_list.ruler, shot_list.length
    walk = by.format_length(length) + (f" ({by.format_heights(length)})" if by.metres is not None else "")
    counts = f"{_format_count(photos, 'photo')} from {_format_count(places, 'place')}"
    return f"{counts}; the walk from the first to the last is {walk}."


def _explain_unit(by: Ruler) -> str:
    if by.metres is not None:
        return ""
    return (
        "<li>How many metres this place measures is not known. Lengths are given in <b>flying heights</b>: one is how "
        "high above the ground the camera was, on the median, in the photos that are there already.</li>"
    )


def _format_card(i: int, station: Station, before: Camera | None, shot_list: ShotList, pictured: bool) -> str:
    camera, by = station.camera, shot_list.ruler
    said = directions.describe_pose(camera, shot_list.frame, by)
    out = camera.centre - shot_list.frame.exemplar.centre
    facts = {
        "Height above the ground": by.format_length(float(out[2])),
        "Distance to the middle": by.format_length(float(np.linalg.norm(out[:2]))),
        "Tilt": directions.describe_tilt(camera),
        "Picture": _describe_shape(camera),
    }
    if by.place:
        ahead = directions.heading(camera)
        facts["Compass"] = f"{by.place.azimuth(ahead):.0f} degrees ({by.format_direction(ahead)})"
    facts["Name"] = station.name
    alt = f"Expected picture from place {i + 1}. {said}"
    size = f'width="{camera.width}" height="{camera.height}"'
    return CARD.substitute(
        number=i + 1,
        picture=f'<img src="{_picture_name(i)}" {size} alt="{escape(alt)}">' if pictured else "",
        way=f"From place {i}: {directions.describe_walk(before, camera, by)}." if before else "Start here.",
        said=escape(said),
        photos=f"<p><b>Take {station.photos} photos from here.</b></p>" if station.photos > 1 else "",
        facts="".join(f"<div><dt>{escape(k)}</dt><dd>{escape(v)}</dd></div>" for k, v in facts.items()),
    )


def _describe_shape(camera: Camera) -> str:
    if camera.width == camera.height:
        return "square, or its middle"
    return "landscape (wider than high)" if camera.width > camera.height else "portrait (higher than wide)"


PICTURE = """<li>Stand there, then move until what the camera shows looks like the picture expected. That picture is
drawn from what is known so far: where it is blurred, flat or torn, your photo is needed most.</li>"""

CARD = Template("""<article id="place-$number">
<h3><span class="badge">$number</span> Place $number <label><input type="checkbox"> taken</label></h3>
<p>$way <a href="#map">Map</a></p>
<p class="said">$said</p>
$photos
$picture
<dl>$facts</dl>
</article>""")

PAGE = Template("""<!doctype html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<meta name="color-scheme" content="light dark">
<title>Shot list: $scene</title>
<style>
:root { color-scheme: light dark; --page: #f4f3ef; --card: #fff; --text: #1c1c1a; --soft: #5a5954; --line: #d5d3cb;
  --strong: #b3261e; }
@media (prefers-color-scheme: dark) { :root { --page: #171714; --card: #23231f; --text: #eeede8; --soft: #b0aea6;
  --line: #45443e; } }
* { box-sizing: border-box; }
body { margin: 0 auto; padding: 1rem; max-width: 46rem; background: var(--page); color: var(--text);
  font: 1.0625rem/1.5 system-ui, sans-serif; }
h1 { font-size: 1.6rem; line-height: 1.2; margin: 0 0 .5rem; }
h2 { font-size: 1.25rem; margin: 2rem 0 .5rem; }
h3 { font-size: 1.1rem; margin: 0 0 .5rem; display: flex; align-items: center; gap: .6rem; }
h3 label { margin-left: auto; font-weight: normal; display: flex; align-items: center; gap: .5rem; padding: .4rem 0; }
input { width: 1.4rem; height: 1.4rem; }
ol, ul { padding-left: 1.4rem; } li { margin: .4rem 0; }
code { overflow-wrap: anywhere; background: var(--line); padding: .1em .3em; border-radius: .25em; }
figure { margin: 0; } figcaption { color: var(--soft); font-size: .95rem; margin-top: .4rem; }
svg, article img { display: block; width: 100%; height: auto; border-radius: .4rem; border: 1px solid var(--line); }
article img { width: auto; max-width: 100%; max-height: 80vh; margin: .6rem auto; }
article { background: var(--card); border: 1px solid var(--line); border-radius: .6rem; padding: 1rem; margin: 1rem 0; }
article:has(input:checked) { opacity: .45; }
article p { margin: .4rem 0; } .said { font-size: 1.15rem; }
.badge { background: var(--strong); color: #fff; border-radius: 50%; min-width: 2rem; height: 2rem; display: grid;
  place-items: center; }
dl { display: grid; grid-template-columns: repeat(auto-fill, minmax(9.5rem, 1fr)); gap: .5rem 1rem; margin: .6rem 0 0; }
dt { color: var(--soft); font-size: .85rem; } dd { margin: 0; overflow-wrap: anywhere; }
svg path, svg rect, svg polyline { fill: none; stroke-linejoin: round; }
svg text { font: bold 25px system-ui, sans-serif; }
.halo { stroke: #fff; stroke-width: 9; } .way { stroke: #222; stroke-width: 4; stroke-dasharray: 4 8; }
.wanted { stroke: #fff; stroke-width: 4; stroke-dasharray: 16 10; paint-order: stroke; }
.cross { stroke: #fff; stroke-width: 5; } .thread { stroke: #b3261e; stroke-width: 3; }
svg .arrow, svg .needle { fill: #b3261e; stroke: #fff; stroke-width: 3; }
.disc { fill: #fff; stroke: #b3261e; stroke-width: 4; } .number { text-anchor: middle; fill: #1c1c1a; }
.bar { stroke: #222; stroke-width: 4; } .legend { fill: #222; stroke: #fff; stroke-width: 6; paint-order: stroke; }
@media print { article { break-inside: avoid; } }
</style>
</head>
<body>
<header>
<h1>Shot list: $scene</h1>
<p>$summary</p>
</header>
<main>
<h2>What to do</h2>
<ol>
<li>Go to the places in the order of their numbers. <a href="#map">The map</a> shows the ground from above.</li>
$picture
<li>Nobody hits a place exactly. Within $near is good; if in doubt, take two or three photos.</li>
<li>Use the camera of the first photos with the same lens, unzoomed. Keep photos as they are: not cut, turned or
filtered. Keep yourself, your shadow and whatever moves out of them.</li>
<li>Put the photos, under any names, into the folder <code>$drop</code> and run the same command again. Each is matched
to its place by what it shows; what is still missing then comes as a new list.</li>
$unit
</ol>
<h2 id="map">Map</h2>
<figure>
<svg viewBox="0 0 $width $height" role="group" aria-label="Map of the places in walking order, from above">
<image href="map.png" width="$width" height="$height"/>
$drawing
</svg>
<figcaption>Arrows: where the camera looks; a number without one looks straight down. White dashes: the piece of ground
that is modelled, with its middle. Dotted line: the way.</figcaption>
</figure>
<h2>Places</h2>
$cards
</main>
</body>
</html>
""")
