"""The front of a page: its scene's name and a line about it, and a still that is there before the terrain is.

They are written into the page's HTML, so that they show before any script runs, and in what other pages say of a link.
"""

import html
import re
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from dav_gswt.errors import InputError
from dav_gswt.images.figures import encode_jpeg
from dav_gswt.images.image_files import read_photo, shrink_image
from dav_gswt.terrain.page_story import Story

STILL, FRONT = "first.jpg", "front.json"
STILL_WIDTH = 1280  # pixels, at most
STILL_BYTES = 90_000  # at most: it is there within a second at 1 Mbit/s
QUALITIES = (80, 70, 60, 50, 40, 30)  # the best that fits is taken; the last one anyhow
STORY_BUTTON = '<button id="storyButton" type="button" aria-controls="story" aria-expanded="false"'
DEFAULT_NAME = "Endless terrain"
DEFAULT_LINE = "An endless terrain made from a few photos"


@dataclass(frozen=True)
class Front:
    """What a page says of its scene. still: a JPEG of what the page shows first, see `encode_still`. story: how it was
    made, where that is known."""

    name: str
    line: str
    still: bytes
    story: Story | None = None

    def to_dict(self) -> dict[str, str]:
        """What front.json holds, for pages that list pages."""
        return {"name": self.name, "line": self.line, "verdict": describe_verdict(self.story)}


def name_of_scene(scene: str) -> str:
    """A scene's key as a title: my_meadow becomes My meadow."""
    words = re.sub(r"[_-]+", " ", scene).strip()
    return words[:1].upper() + words[1:]


def line_of_photos(photos: int) -> str:
    """The line about a scene; photos: what its field was made from, 0 where a finished field came instead."""
    if not photos:
        return "An endless terrain made from a Gaussian field"
    return f"An endless terrain made from {photos} photo{'s' * (photos > 1)}"


def describe_verdict(story: Story | None) -> str:
    """What tests said of a terrain's photos and of the field made of them; nothing where nobody tested."""
    if not story:
        return ""
    said = {"good": "The photos fit together well.", "doubtful": "It is doubtful that the photos fit together."}
    parts = [said.get(story.value.get("grade") or "", "")]
    tested = [one["psnr"] for one in story.value["rounds"] if one["psnr"] is not None]
    if tested:
        parts.append(f"Photos that were not used are predicted to {tested[-1]:.1f} dB.")
    return " ".join(filter(None, parts))


def front_of_scene(scene: str, story: Story | None, still: Path | str) -> Front:
    """The front of a scene's page, from the still of the place where everybody begins. Raises: as `encode_still`."""
    photos = len(story.value["photos"]) if story else 0
    return Front(name_of_scene(scene), line_of_photos(photos), encode_still(still), story)


def encode_still(path: Path | str) -> bytes:
    """A still as a JPEG of at most STILL_WIDTH pixels across and, where quality allows, STILL_BYTES.

    Raises: InputError: the file is no readable image.
    """
    image = read_photo(path)
    height, width = image.shape[:2]
    if width > STILL_WIDTH:
        image = shrink_image(image, STILL_WIDTH, max(1, round(height * STILL_WIDTH / width)))
    made = b""
    for quality in QUALITIES:
        made = encode_jpeg(image, quality)
        if len(made) <= STILL_BYTES:
            break
    return made


def fill_front(source: str, front: Front | None, modules: Iterable[str]) -> str:
    """The page's HTML with the front and its script's modules, which browsers then ask for all at once.

    source: index.html of the viewer; where front is None, its own texts stay. modules: paths from the page.
    Raises: InputError: index.html lacks the place of something.
    """
    links = "\n  ".join(f'<link rel="modulepreload" href="{html.escape(name)}">' for name in modules)
    filled = _replace(source, "<!-- modules -->", links)
    if front is None:
        return _replace(filled, "<!-- first -->", "")
    name, line = html.escape(front.name), html.escape(front.line)
    filled = _replace(filled, "<!-- first -->", f'<img id="first" src="{STILL}" alt="">')
    if front.story:
        filled = _replace(filled, f"{STORY_BUTTON} hidden>", f"{STORY_BUTTON}>")
    filled = _replace(filled, f"<title>{DEFAULT_NAME}</title>", f"<title>{name} · {line}</title>")
    filled = _replace(filled, f'content="{DEFAULT_LINE}"', f'content="{name}: {line}"')
    filled = _replace(filled, f'<h1 id="name">{DEFAULT_NAME}</h1>', f'<h1 id="name">{name}</h1>')
    return _replace(filled, f'<p id="line">{DEFAULT_LINE}</p>', f'<p id="line">{line}</p>')


def _replace(source: str, mark: str, by: str) -> str:
    if source.count(mark) != 1:
        raise InputError(f"the viewer's index.html must hold {mark!r} once")
    return source.replace(mark, by)
