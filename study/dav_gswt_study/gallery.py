"""The page docs/gallery.md: each scene as photographed and as terrain, its verdict and numbers, and a walk."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from jaxtyping import Float, Float32
from numpy import ndarray as Array

from dav_gswt.bundle import manifest
from dav_gswt.bundle.manifest import Manifest
from dav_gswt.files import atomic_file, read_json
from dav_gswt.images import image_files
from dav_gswt.images.figures import encode_jpeg
from dav_gswt.materials.store import read_report
from dav_gswt.sweeps import MEGA, select_metrics
from dav_gswt.terrain.endless import EndlessTerrain
from dav_gswt.terrain.light import light_of
from dav_gswt.terrain.page import name_of_scene
from dav_gswt.terrain.stills import Shot, render_view, shot_camera
from dav_gswt_study.markdown import format_number, format_table

HEIGHT, GAP = 300, 4  # pixels: of a row of pictures, and between two of them
ASPECTS = (4 / 3, 1.0, 16 / 9)  # of a photo, the terrain from above, what a walker sees
QUALITY, WALK_QUALITY = 82, 55


def draw_scene(photo: Path | str, above: Path | str, walker: Path | str, out: Path | str) -> None:
    """Write a photo, the terrain from above and as a walker sees it side by side, as a JPEG."""
    parts: list[Float[Array, "_ _ 3"]] = []
    for path, aspect in zip((photo, above, walker), ASPECTS, strict=True):
        image = image_files.read_photo(path)
        parts += [crop_and_shrink(image, round(HEIGHT * aspect), HEIGHT), np.ones((HEIGHT, GAP, 3))]
    with atomic_file(out) as part:
        part.write_bytes(encode_jpeg(np.concatenate(parts[:-1], 1), QUALITY))


def suit_width(terrain: EndlessTerrain, width: int) -> EndlessTerrain:
    """The terrain with levels that begin where they do in pictures of the reference's width: nearer in smaller ones."""
    factor = min(1.0, width / manifest.WIDTH)
    scaled = ([factor * value for value in values] for values in (terrain.switches, terrain.bands))
    return replace(terrain, **dict(zip(("switches", "bands"), scaled, strict=True)))


def render_moment(
    terrain: EndlessTerrain, shot: Shot, manifest: Manifest, hour: float, width: int, height: int
) -> Float32[Array, "h w 3"]:
    """A shot of the terrain at a solar time."""
    camera = shot_camera(shot, terrain, manifest.eye_floor, width, height)
    return render_view(terrain, camera, manifest.sky, manifest.ground_colour, light=light_of(manifest, hour))


def animate_frames(frames: Sequence[Float[Array, "h w 3"]], rate: int, out: Path | str) -> None:
    """Write pictures one after the other as an endless WebP. rate: frames a second."""
    from PIL import Image  # here, not above: Pillow loads its plugins

    pixels = (np.rint(np.clip(frame, 0, 1) * 255).astype(np.uint8) for frame in frames)
    first, *others = map(Image.fromarray, pixels)
    options = {"duration": round(1000 / rate), "loop": 0, "quality": WALK_QUALITY, "method": 4}
    with atomic_file(out) as part:
        first.save(part, format="WEBP", save_all=True, append_images=others, **options)


def tabulate_scene(cell: dict) -> dict:
    """A scene's numbers and verdict.

    cell: `scene`, `kind` of the config, the paths `metrics` and `manifest`, and the folder `materials`, None where the
    scene's ground was taken as one.
    """
    metrics, manifest = read_json(cell["metrics"]), read_json(cell["manifest"])
    real = cell["kind"] == "photos"
    found = select_metrics(metrics, "psnr_colour_corrected" if real else "psnr")
    row = {"scene": cell["scene"], "real": real, "photos": metrics["photos"], "gaussians": metrics["gaussians"]}
    row |= {key: found[key] for key in ("psnr", "ssim", "lpips")}
    row |= {
        "bundle_mb": sum(part["bytes"] for part in manifest["parts"]) / MEGA,
        "version": metrics["provenance"]["version"],
    }
    verdict = read_report(cell["materials"]).verdict if cell["materials"] else None
    return row | {"grade": verdict and verdict.grade, "reason": verdict and verdict.reason}


def describe_gallery(rows: list[dict], walk: str, seconds: float) -> dict:
    """The values of the page's template. rows: of `tabulate_scene`; walk: the scene that is walked over, seconds: for
    so long."""
    head = ["scene", "photos", "PSNR (dB)", "SSIM", "LPIPS", "Gaussians", "bundle (MB)"]
    for row in rows:
        row["name"] = name_of_scene(row["scene"])
    numbers = format_table(head, map(_format_row, rows))
    return {"rows": rows, "walk": walk, "name": name_of_scene(walk), "seconds": f"{seconds:.0f}", "numbers": numbers}


def _format_row(row: dict) -> list[str]:
    numbers = [format_number(row[key], digits) for key, digits in (("psnr", 2), ("ssim", 3), ("lpips", 3))]
    return [row["scene"], str(row["photos"]), *numbers, str(row["gaussians"]), f"{row['bundle_mb']:.1f}"]


def crop_and_shrink(photo: Float[Array, "_ _ 3"], width: int, height: int) -> Float[Array, "h w 3"]:
    """The middle of a photo at the shape of width x height pixels."""
    rows, columns = photo.shape[:2]
    wide = min(columns, max(width, int(rows * width / height)))
    tall = min(rows, max(height, int(columns * height / width)))
    top, left = (rows - tall) // 2, (columns - wide) // 2
    middle = photo[top : top + tall, left : left + wide]
    times = max(1, -(-width // middle.shape[1]), -(-height // middle.shape[0]))  # small photos: pixels become blocks
    large = np.ascontiguousarray(middle.repeat(times, 0).repeat(times, 1), np.float32)
    return image_files.shrink_image(large, width, height)
