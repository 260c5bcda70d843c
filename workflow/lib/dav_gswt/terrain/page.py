"""Page folders, ready for any web server: viewer, manifest, surface and parts, and the front of the scene.

The front is the scene's name, a line about it and a still. They are written into the HTML, so that they show before any
script runs, and in what other pages say of a link.
"""

import html
import re
import shutil
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from dav_gswt.bundle.manifest import NAME as MANIFEST
from dav_gswt.bundle.manifest import Manifest, read_manifest
from dav_gswt.errors import InputError
from dav_gswt.files import atomic_folder, write_json
from dav_gswt.images.figures import encode_jpeg
from dav_gswt.images.image_files import read_photo, shrink_to
from dav_gswt.terrain.class_rules import NOISE, apply_rule
from dav_gswt.terrain.heights import PIXELS, FlatSurface, HeightField, require_plain_cover
from dav_gswt.terrain.light import apply_light
from dav_gswt.terrain.page_story import SHEET, STORY, Story

INDEX, STILL = "index.html", "first.jpg"
OWN_SCRIPTS = ("early.js", "worker/", "api/", "terrain_api.js")  # that are no modules of the page itself
STILL_SIZE = 1280  # pixels of its longer side, at most
STILL_BYTES = 90_000  # at most: it is there within a second at 1 Mbit/s
QUALITIES = (80, 70, 60, 50, 40, 30)  # the best that fits is taken; the last one anyhow
STORY_BUTTON = '<button id="storyButton" type="button" aria-controls="story" aria-expanded="false"'
DEFAULT_NAME, DEFAULT_LINE = "Endless terrain", "An endless terrain made from a few photos"


@dataclass(frozen=True)
class Front:
    """The front of a scene's page.

    still: a JPEG of what the page shows first, see `encode_still`. story: how it was made, where that is known.
    """

    name: str
    line: str
    still: bytes
    story: Story | None = None


def front_of_scene(scene: str, story: Story | None, still: Path | str) -> Front:
    """The front of a scene's page. still: of the place where everybody begins. Raises: as `encode_still`."""
    line = "An endless terrain made from a Gaussian field"
    if story:
        count = len(story.value["photos"])
        line = f"An endless terrain made from {count} photo{'s' * (count > 1)}"
    return Front(name_of_scene(scene), line, encode_still(still), story)


def name_of_scene(scene: str) -> str:
    """A scene's key as a title: my_meadow becomes My meadow."""
    words = re.sub(r"[_-]+", " ", scene).strip()
    return words[:1].upper() + words[1:]


def encode_still(path: Path | str) -> bytes:
    """A still as a JPEG of at most STILL_SIZE pixels a side and, where quality allows, STILL_BYTES.

    Raises: InputError: the file is no readable image.
    """
    image, made = shrink_to(read_photo(path), STILL_SIZE), b""
    for quality in QUALITIES:
        made = encode_jpeg(image, quality)
        if len(made) <= STILL_BYTES:
            break
    return made


def write_page(
    bundle_dir: Path | str,
    viewer_dir: Path | str,
    out_dir: Path | str,
    surface: HeightField | None = None,
    rule: Sequence[dict[str, Any]] = NOISE,
    front: Front | None = None,
    sun: Any = "none",
    wind: float = 0.0,
) -> None:
    """Copy viewer, manifest and parts to `out_dir`, atomically: an older page stays until the new one is complete.

    All files under `viewer_dir` are copied, and the parts that the manifest names.

    Args:   surface: of the terrain (default: level ground), stored in the page's manifest as `heights`. rule: the
            config's `classes`, stored as those of the page's manifest. front: name of the scene, line about it, first
            still and story (default: the viewer's own texts, no still, no story). sun, wind: of the config.
    Raises: InputError: a part is missing; see also `manifest.read_manifest`,
            `class_rules.apply_rule`, `heights.require_plain_cover`.
    """
    bundle, viewer, out, surface = Path(bundle_dir), Path(viewer_dir), Path(out_dir), surface or FlatSurface()
    manifest = apply_light(apply_rule(read_manifest(bundle), rule), sun, wind, surface)
    require_plain_cover(surface, manifest.classes, manifest.objects)
    copies = [(path, str(path.relative_to(viewer))) for path in sorted(viewer.rglob("*")) if path.is_file()]
    copies += [(bundle / name, name) for name in _list_parts(bundle, manifest)]
    heights, pixels = surface.describe()
    with atomic_folder(out) as part:
        for source, name in copies:
            (part / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(source, part / name)
        modules = [name for _, name in copies if name.endswith(".js") and not name.startswith(OWN_SCRIPTS)]
        index = (part / INDEX).read_text(encoding="utf-8")
        (part / INDEX).write_text(fill_front(index, front, modules), encoding="utf-8")
        if pixels:
            (part / PIXELS).write_bytes(pixels)
        if front:
            (part / STILL).write_bytes(front.still)
        if front and front.story:
            write_json(part / STORY, front.story.value)
            (part / SHEET).write_bytes(front.story.sheet)
        write_json(part / MANIFEST, replace(manifest, heights=heights).to_dict())


def _list_parts(bundle: Path, manifest: Manifest) -> list[str]:
    """The files of parts that a bundle's manifest names. Raises: InputError: one is missing."""
    names = [part.file for part in manifest.parts]
    for name in names:
        if not (bundle / name).is_file():
            raise InputError(f"{bundle / name}: this part is missing; make the bundle again")
    return names


def fill_front(source: str, front: Front | None, modules: Iterable[str]) -> str:
    """The page's HTML with the front and its script's modules, which browsers then ask for all at once.

    source: index.html of the viewer; where front is None, its own texts stay. modules: paths from the page.
    Raises: InputError: index.html lacks the place of something.
    """
    links = "\n  ".join(f'<link rel="modulepreload" href="{html.escape(name)}">' for name in modules)
    filled = {"<!-- modules -->": links, "<!-- first -->": ""}
    if front:
        name, line = html.escape(front.name), html.escape(front.line)
        filled |= {
            "<!-- first -->": f'<img id="first" src="{STILL}" alt="">',
            f"<title>{DEFAULT_NAME}</title>": f"<title>{name} · {line}</title>",
            f'content="{DEFAULT_LINE}"': f'content="{name}: {line}"',
            f'<h1 id="name">{DEFAULT_NAME}</h1>': f'<h1 id="name">{name}</h1>',
            f'<p id="line">{DEFAULT_LINE}</p>': f'<p id="line">{line}</p>',
        }
    if front and front.story:
        filled |= {f"{STORY_BUTTON} hidden>": f"{STORY_BUTTON}>"}
    for mark, by in filled.items():
        if source.count(mark) != 1:
            raise InputError(f"the viewer's index.html must hold {mark!r} once")
        source = source.replace(mark, by)
    return source
