"""Page folders, ready for any web server: viewer, manifest, surface and parts, the front of the scene, and its story.

The front is the scene's name, a line about it and a still. They are written into the HTML, so that they show before any
script runs, and in what other pages say of a link. The story is how the terrain was made: story.json (where photos were
taken over the ground, the rounds, what tests said) and photos.jpg, the photos beside and below each other.
"""

import html
import re
import shutil
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float32
from numpy import ndarray as Array

from dav_gswt.bundle.manifest import NAME as MANIFEST
from dav_gswt.bundle.manifest import Manifest, read_manifest
from dav_gswt.errors import InputError
from dav_gswt.files import atomic_folder, read_json, write_json
from dav_gswt.geometry.scene_frame import read_scene_frame
from dav_gswt.images.figures import encode_jpeg
from dav_gswt.images.image_files import read_photo, shrink_to
from dav_gswt.paths import decode_path
from dav_gswt.photos.capture_record import TakenPhoto, list_taken_photos
from dav_gswt.photos.view_split import read_view_split
from dav_gswt.terrain.class_rules import NOISE, apply_rule
from dav_gswt.terrain.heights import PIXELS, FlatSurface, HeightField, require_plain_cover
from dav_gswt.terrain.light import apply_light

STORY, SHEET = "story.json", "photos.jpg"
MOST = 64  # photos that are shown in small, spread over all
THUMB, COLUMNS, QUALITY = 120, 8, 60  # longer side in pixels; of the sheet; of its JPEG
INDEX, STILL = "index.html", "first.jpg"
OWN_SCRIPTS = ("early.js", "worker/", "api/", "terrain_api.js")  # that are no modules of the page itself
STILL_SIZE = 1280  # pixels of its longer side, at most
STILL_BYTES = 90_000  # at most: it is there within a second at 1 Mbit/s
QUALITIES = (80, 70, 60, 50, 40, 30)  # the best that fits is taken; the last one anyhow
STORY_BUTTON = '<button id="storyButton" type="button" aria-controls="story" aria-expanded="false"'
DEFAULT_NAME, DEFAULT_LINE = "Endless terrain", "An endless terrain made from a few photos"


@dataclass(frozen=True)
class Story:
    """How a terrain was made.

    Attributes:
        value: content of story.json, with these keys.
            unit: name of the unit of length.
            half: half the side of the ground.
            photos: for each photo, its `round`, the place of its camera from the middle of the ground (`at`), its
                viewing direction to the east and north (`look`), and its number in the sheet (`picture`), if any.
            rounds: for each round, the number of its `photos` and the `psnr` of the test photos. The PSNR is null if
                another preset fitted the round or no photos were set aside for testing.
            thumb, columns, pictures: side of a picture of the sheet in pixels, pictures in a row, number of pictures.
            grade: verdict on the photos; null: unknown.
        sheet: content of photos.jpg.
    """

    value: dict[str, Any]
    sheet: bytes


def tell_story(given: Mapping[str, Any]) -> Story | None:
    """The story of a round's field, or None for a finished field, which has no photos.

    Args:   given: `views` (views.json), `images` and `model` of the scene, `frame` (ground.json), `captures` of
            the rounds, `metrics` (metrics.json) of the first fit and of each round, which may be another preset's
            before the last; without `views`: a finished field.
    Raises: InputError: a file is missing or not of its kind.
    """
    if not given.get("views"):
        return None
    taken = list_photos(given)
    shown = np.unique(np.linspace(0, len(taken) - 1, min(len(taken), MOST)).round().astype(int)).tolist()
    frame, photos = read_scene_frame(given["frame"]), []
    for photo in taken:  # where its camera is, seen from the exemplar's centre, and where it looks, on the ground
        at = (photo.camera.centre - frame.exemplar.centre).tolist()
        look = photo.camera.rotation[2, :2].tolist()
        photos.append({"round": photo.round, "at": [round(v, 3) for v in at], "look": [round(v, 3) for v in look]})
    for number, k in enumerate(shown):
        photos[k]["picture"] = number
    presets = [decode_path(Path(path)).get("preset") for path in given["metrics"]]
    rounds = [
        {
            "photos": sum(photo.round == t for photo in taken),
            # fits of another preset cannot be compared: they were measured on smaller photos and other ground
            "psnr": _psnr(path, frame.kind) if preset == presets[-1] else None,
        }
        for t, (path, preset) in enumerate(zip(given["metrics"], presets, strict=True))
    ]
    half = frame.exemplar.side / 2
    value = {
        "unit": frame.unit, "half": half, "photos": photos, "rounds": rounds, "thumb": THUMB, "columns": COLUMNS,
        "pictures": len(shown), "grade": frame.verdict.grade if frame.verdict else None,
    }  # fmt: skip
    smalls = [shrink_to(read_photo(taken[k].source), THUMB) for k in shown]
    return Story(value, encode_jpeg(draw_sheet(smalls), QUALITY))


def list_photos(given: Mapping[str, Any]) -> list[TakenPhoto]:
    """All photos of a round's field in the order they were taken. Raises: as `tell_story`."""
    from dav_gswt.photos.colmap_model import read_colmap_model  # here, not above: it loads pycolmap

    start = read_view_split(given["views"]).start
    return list_taken_photos(given["images"], read_colmap_model(given["model"]), start, given["captures"])


def draw_sheet(smalls: Sequence[Float32[Array, "_ _ 3"]]) -> Float32[Array, "height width 3"]:
    """Small photos, each in the middle of a square of THUMB pixels, COLUMNS in a row."""
    rows = max(1, -(-len(smalls) // COLUMNS))
    sheet = np.zeros((rows * THUMB, COLUMNS * THUMB, 3), np.float32)
    for k, small in enumerate(smalls):
        height, width = small.shape[:2]
        top, left = k // COLUMNS * THUMB + (THUMB - height) // 2, k % COLUMNS * THUMB + (THUMB - width) // 2
        sheet[top : top + height, left : left + width] = small
    return sheet


def _psnr(path: Path | str, kind: str) -> float | None:
    """PSNR of the test photos in metrics.json, in the windows if there are any, of real photos after their exposure is
    fitted; None: none was spared."""
    values = read_json(path)
    value = values.get("windows", values).get("psnr_colour_corrected" if kind == "photos" else "psnr")
    return round(value, 2) if isinstance(value, int | float) and np.isfinite(value) else None


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
