"""What `dav-gswt gaps` takes and finds: 100 photos of 12 megapixels, and the same flight with a hole cut into its plan.

Photos are warps of one large texture over hills, with EXIF focal lengths and GPS positions that are a metre off.
Figures go to results/bench.json. `python benchmarks/gaps.py FOLDER` keeps photos and results in a folder.
"""

import json
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from PIL import ExifTags, Image
from record import report_figures
from scipy.ndimage import gaussian_filter, uniform_filter1d

from dav_gswt.geometry.cameras import Camera
from dav_gswt.geometry.georeference import Georeference

WIDTH, HEIGHT, FILM = 4000, 3000, 26.0  # pixels; focal length in mm, 35 mm equivalent
FOCAL = FILM / 43.2666 * 5000  # pixels
FLYING = 60.0  # metres
SIDE = 10  # photos along each side of the flight plan
STEPS = 0.35 * FLYING * WIDTH / FOCAL, 0.25 * FLYING * HEIGHT / FOCAL  # metres: overlap 65 % across, 75 % along
HOLE = {line * SIDE + place for line in (4, 5, 6) for place in (3, 4, 5, 6)}  # photos that the second set lacks
BLURRED, SMEAR = 22, 40  # photo, and pixels along which it is smeared
PLACE = Georeference(52.1, 13.2, 40.0, north=0.0, metres_per_unit=1.0)
TEXEL, DETAIL, REDUCED = 0.09, 2048, 8  # metres; pixels of the fine texture, which repeats; of the map of hits
GRAIN = (0.6, 1.5, 4.0, 12.0, 40.0)  # standard deviations of the noises of the texture, texels


def find_height(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Hills, metres."""
    return 3 * np.sin(x / 31) * np.cos(y / 23) + 1.5 * np.sin(x / 11 + y / 17)


def make_texture(rng: np.random.Generator, size: int) -> np.ndarray:
    """Grey noise with equal contrast at several scales, 0 to 255."""
    total = sum(
        noise / noise.std() for noise in (gaussian_filter(rng.random((size, size), np.float32), s) for s in GRAIN)
    )
    return np.clip(128 + 28 * (total - total.mean()), 0, 255).astype(np.float32)


def place_cameras(rng: np.random.Generator) -> list[Camera]:
    """A flight in lines to and fro, straight down but for a pilot's errors."""
    cameras = []
    for i in range(SIDE * SIDE):
        line, place = divmod(i, SIDE)
        at = np.array([(line - 4.5) * STEPS[0], (place - 4.5) * STEPS[1], FLYING]) + rng.normal(0, 0.5, 3)
        a, (b, c) = np.pi * (line % 2) + rng.normal(0, 0.05), rng.normal(0, 0.03, 2)
        turn = np.array([[np.cos(a), np.sin(a), 0], [np.sin(a), -np.cos(a), 0], [0, 0, -1.0]])
        lean = np.array([[1, 0, b], [0, 1, c], [-b, -c, 1]])
        u, _, v = np.linalg.svd(lean @ turn)
        rotation = u @ v
        cameras.append(Camera(rotation, -rotation @ at, FOCAL, FOCAL, WIDTH / 2, HEIGHT / 2, WIDTH, HEIGHT))
    return cameras


def take_photo(camera: Camera, coarse: np.ndarray, fine: np.ndarray) -> np.ndarray:
    """The picture of a camera. Where rays meet the hills is found on a coarse grid, and interpolated."""
    edge = REDUCED // 2 - REDUCED
    v, u = np.mgrid[edge : HEIGHT + REDUCED : REDUCED, edge : WIDTH + REDUCED : REDUCED].astype(float)
    rays = np.stack([(u - WIDTH / 2) / FOCAL, (v - HEIGHT / 2) / FOCAL, np.ones_like(u)], -1) @ camera.rotation
    centre, height = camera.centre, np.zeros_like(u)
    for _ in range(12):
        hits = centre + rays * ((height - centre[2]) / rays[..., 2])[..., None]
        height = find_height(hits[..., 0], hits[..., 1])
    box = 1, 1, 1 + WIDTH // REDUCED, 1 + HEIGHT // REDUCED
    x, y = (
        np.asarray(
            Image.fromarray(hits[..., k].astype(np.float32)).resize((WIDTH, HEIGHT), Image.Resampling.BILINEAR, box)
        )
        for k in (0, 1)
    )
    size = len(coarse)
    across, down = (np.clip(x / TEXEL + size / 2, 0, size - 2), np.clip(y / TEXEL + size / 2, 0, size - 2))
    j, i = across.astype(np.int32), down.astype(np.int32)
    a, b, flat, at = across - j, down - i, coarse.ravel(), i * size + j
    grey = (flat[at] * (1 - a) + flat[at + 1] * a) * (1 - b) + (flat[at + size] * (1 - a) + flat[at + size + 1] * a) * b
    pixel = FLYING / FOCAL
    return grey + fine[(y / pixel).astype(np.int32) % DETAIL, (x / pixel).astype(np.int32) % DETAIL]


def write_photo(path: Path, grey: np.ndarray, at: np.ndarray) -> None:
    """A JPEG as of a drone: sand-coloured, with EXIF. at: latitude, longitude, altitude."""
    rgb = np.clip(grey[..., None] * np.float32([1.05, 0.95, 0.8]), 0, 255).astype(np.uint8)
    exif = Image.Exif()
    exif.get_ifd(ExifTags.IFD.Exif)[ExifTags.Base.FocalLengthIn35mmFilm] = int(FILM)
    degrees = [(float(int(v)), float(int(v % 1 * 60)), round(v * 60 % 1 * 60, 5)) for v in at[:2]]
    gps = exif.get_ifd(ExifTags.IFD.GPSInfo)
    gps |= {1: "N", 2: degrees[0], 3: "E", 4: degrees[1], 5: b"\0", 6: round(float(at[2]), 3)}
    Image.fromarray(rgb).save(path, quality=88, exif=exif)


def make_photos(folder: Path) -> tuple[Path, Path]:
    """The folders of the whole flight and of the one with a hole."""
    rng = np.random.default_rng(0)
    coarse, fine = make_texture(rng, 4096), make_texture(rng, DETAIL)
    fine = 0.4 * (fine - gaussian_filter(fine, 4, mode="wrap"))
    whole, holed = folder / "whole", folder / "holed"
    for one in (whole, holed):
        one.mkdir(parents=True, exist_ok=True)
    for i, camera in enumerate(place_cameras(rng)):
        path, off = whole / f"DJI_{i:04d}.jpg", rng.normal(0, 1, 3)
        if not path.exists():
            grey = take_photo(camera, coarse, fine)
            if i == BLURRED:
                grey = uniform_filter1d(grey, SMEAR, axis=1)
            write_photo(path, grey, PLACE.to_earth((camera.centre + off)[None])[0])
        if i not in HOLE and not (holed / path.name).exists():
            (holed / path.name).hardlink_to(path)
    return whole, holed


def measure(photos: Path, out: Path) -> tuple[float, float, int, list[dict]]:
    """Seconds, the largest memory of any measured run so far in MB, exit code, and the gaps."""
    start = time.perf_counter()
    done = subprocess.run([sys.executable, "-m", "dav_gswt.cli.main", "gaps", str(photos), "-o", str(out)], check=False)
    seconds = time.perf_counter() - start
    memory = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss / 1000
    return seconds, memory, done.returncode, json.loads((out / "gaps.geojson").read_text())["features"]


TARGETS = {"gaps_seconds": 180, "gaps_memory_mb": 2000, "gaps_of_whole_flight": 0}


def main() -> None:
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(sys.argv[1] if len(sys.argv) > 1 else scratch)
        whole, holed = make_photos(folder)
        seconds, memory, code, gaps = measure(whole, folder / "whole-gaps")
        _, _, code_holed, found = measure(holed, folder / "holed-gaps")
        print(
            f"whole flight: exit code {code}, gaps {len(gaps)}; with a hole: exit code {code_holed}, gaps {len(found)}"
        )
        figures = {"gaps_seconds": seconds, "gaps_memory_mb": memory, "gaps_of_whole_flight": float(len(gaps))}
        report_figures(figures | {"gaps_of_hole": float(len(found))}, TARGETS)


if __name__ == "__main__":
    main()
