"""A minute of video at 1080p, a third of it blurred: how long the choice of frames takes, and what finds its place.

The video is a rendered flight in three legs over a finite synthetic field; rendering takes some minutes. In its middle
third, or in every third stretch of two seconds (`bursts`), the camera shakes during each exposure. Every figure goes to
results/bench.json.
"""

import argparse
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

import av
import numpy as np
from record import report_figures

from dav_gswt.field import GaussianField
from dav_gswt.geometry.cameras import Camera, pinhole
from dav_gswt.photos.sfm.registration import SfmOptions, register_photos
from dav_gswt.photos.synthetic.noise import make_noise
from dav_gswt.photos.video import write_frames
from dav_gswt.raster import render
from dav_gswt.reconstruction.discs import make_ground_discs
from dav_gswt.reconstruction.ground import Ground

SECONDS, RATE = 60, 30
WIDTH, HEIGHT = 1920, 1080
FIELD_OF_VIEW = 55.0  # degrees
SPACING, WEST_EAST, SOUTH_NORTH = 0.015, 12.4, 24.0  # metres: between Gaussians, and the field's sides
LEG, ASIDE, ABOVE = 14.0, 1.8, 6.0  # metres: length of a leg, from one to the next, over the ground
SHAKE = 12, 30  # pixels that the picture moves during an exposure, where the camera shakes
SAMPLES = 12  # of such an exposure
NOISE = 0.006  # of the sensor
MARGIN = 24  # pixels around the picture that are rendered too
TARGETS = {"video_choose_seconds": 40, "video_blurred_frames": 0, "video_placed_share": 0.95}


def make_field(seed: int = 0) -> GaussianField:
    """Rolling ground with coloured grain."""
    rng = np.random.default_rng(seed)
    rows, columns = round(SOUTH_NORTH / SPACING), round(WEST_EAST / SPACING)

    def noise(longest: float, shortest: float, slope: float) -> np.ndarray:
        return make_noise(rng, rows, SOUTH_NORTH, longest, shortest, slope)[:, :columns]

    heights, grain, tint = 0.2 * noise(8.0, 1.5, 2.0), noise(4.0, 0.03, 0.4), noise(10.0, 1.0, 1.0)
    base = np.array([0.52, 0.44, 0.33]) + tint[..., None] * np.array([0.03, 0.01, -0.02])
    colours = np.clip(base * (1 + 0.28 * grain[..., None]), 0, 1).reshape(-1, 3).astype(np.float32)
    seen = np.ones((rows, columns), bool)
    return make_ground_discs(Ground(-WEST_EAST / 2, -SOUTH_NORTH / 2, SPACING, 0, 0, 1, heights, seen), colours)


def list_cameras(count: int) -> Iterator[Camera]:
    """The cameras of a flight: north, south and north again; they look down, and up to 25 degrees ahead."""
    corners = np.array([[-1, -1], [-1, 1], [0, 1], [0, -1], [1, -1], [1, 1]]) * [ASIDE, LEG / 2]
    lengths = np.r_[0, np.cumsum(np.hypot(*np.diff(corners, axis=0).T))]
    width, height = WIDTH + 2 * MARGIN, HEIGHT + 2 * MARGIN
    for share in np.arange(count) / count:
        x, y = (np.interp(share * lengths[-1], lengths, corners[:, axis]) for axis in (0, 1))
        ahead = ABOVE * np.tan(np.radians(12.5 * (1 - np.cos(10 * np.pi * share))))
        sway = 0.1 * np.sin(30 * share)
        yield pinhole([x + sway, y, ABOVE], [x, y + ahead, 0], width, height, FIELD_OF_VIEW, up=(0.0, 1.0, 0.0))


def find_shaken(count: int, bursts: bool) -> np.ndarray:
    """Which frames are blurred: a third of all."""
    place = np.arange(count) / RATE % 6 / 6 if bursts else np.arange(count) / count
    return (place >= 1 / 3) & (place < 2 / 3)


def make_flight(path: Path, seconds: float = SECONDS, bursts: bool = False, seed: int = 0) -> np.ndarray:
    """Write the video. Returns which of its frames are blurred.

    Every other frame is rendered. The one after it is the same picture, moved on by half the way to the next.
    """
    field, rng = make_field(seed), np.random.default_rng(seed)
    shaken = find_shaken(round(seconds * RATE) // 2 * 2, bursts)
    cameras = list(list_cameras(len(shaken) // 2))
    noise = rng.normal(0, NOISE, (2 * HEIGHT, WIDTH, 3)).astype(np.float32)
    with av.open(str(path), "w") as container:
        stream = container.add_stream("libx264", rate=RATE, options={"crf": "20", "preset": "veryfast"})
        stream.width, stream.height, stream.pix_fmt = WIDTH, HEIGHT, "yuv420p"
        for number, blurred in enumerate(shaken):
            at = number // 2
            if number % 2 == 0:
                image = take_photo(field, cameras[at])
            way = cameras[min(at + 1, len(cameras) - 1)].centre - cameras[at].centre
            move = number % 2 / 2 * cameras[at].fx / ABOVE * way[:2] * [1, -1]  # pixels, to the right and down
            length, angle = (rng.uniform(*SHAKE), rng.uniform(0, np.pi)) if blurred else (0.0, 0.0)
            picture = expose(image, move, length, angle) + noise[rng.integers(HEIGHT) :][:HEIGHT]
            pixels = np.rint(255 * np.clip(picture, 0, 1)).astype(np.uint8)
            container.mux(stream.encode(av.VideoFrame.from_ndarray(pixels, "rgb24")))
        container.mux(stream.encode(None))
    return shaken


def take_photo(field: GaussianField, camera: Camera) -> np.ndarray:
    """A render of what lies in the camera's view."""
    x, y, z = camera.rotation.astype(np.float32) @ field.means.T + camera.translation.astype(np.float32)[:, None]
    seen = (np.abs(x) < 0.53 * WIDTH / camera.fx * z) & (np.abs(y) < 0.55 * HEIGHT / camera.fy * z)
    return render(field[seen], camera).colour


def expose(image: np.ndarray, move: np.ndarray, length: float, angle: float) -> np.ndarray:
    """The middle of a picture moved on, and its mean over an exposure in which the camera turns by `length` pixels."""
    along = np.linspace(-length / 2, length / 2, SAMPLES if length else 1)
    total = np.zeros((HEIGHT, WIDTH, 3), np.float32)
    for way in along:
        right, down = np.rint(move + way * np.array([np.cos(angle), np.sin(angle)])).astype(int) + MARGIN
        total += image[down : down + HEIGHT, right : right + WIDTH]
    return total / len(along)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=SECONDS)
    parser.add_argument("--bursts", action="store_true")
    parser.add_argument("--keep", type=Path, help="a folder for the video and its frames")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as scratch:
        folder = options.keep or Path(scratch)
        folder.mkdir(parents=True, exist_ok=True)
        video, known = folder / "flight.mp4", folder / "shaken.npy"
        if not known.exists():
            np.save(known, make_flight(video, options.seconds, options.bursts))
        shaken, start = np.load(known), time.perf_counter()
        frames = write_frames(video, folder / "frames", threads=2)
        seconds = time.perf_counter() - start
        blurred = sum(shaken[int(path.stem.removeprefix("frame_"))] for path in frames)
        found = register_photos(folder / "frames", SfmOptions(threads=2))
    print(f"{len(frames)} frames of {len(shaken)}, {blurred} of them blurred; {found.verdict}")
    placed = len(found.model.names) / len(frames)
    values = {"choose_seconds": seconds, "blurred_frames": float(blurred), "placed_share": placed}
    report_figures({f"video_{name}": value for name, value in values.items()}, TARGETS)


if __name__ == "__main__":
    main()
