"""Frames of a video that structure from motion can use: sharp ones, each a little farther along than the one before.

Two passes over the video. The first measures each frame, shrunk and grey: how sharp it is, and how far the picture has
moved. The second writes the chosen frames at full size.
"""

import logging
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import av
import numpy as np
from jaxtyping import Float, Float32, Int
from numpy import ndarray as Array
from scipy import fft

from dav_gswt.errors import InputError
from dav_gswt.files import atomic_folder
from dav_gswt.images import image_files
from dav_gswt.logs import progress

_log = logging.getLogger(__name__)

WIDTH = 480  # pixels of the shrunk frames
MOST_FRAMES = 200
STEP = 0.15  # of a picture's width that the view moves on between chosen frames: five in six parts overlap
LEAST_MOTION = 0.5  # pictures' widths in all: less is a camera that stands still
BLUR = 0.6  # a frame with less than this share of the usual fine detail is blurred
USUAL = 80  # percentile of all frames that is usual
LONGEST = 3600.0  # seconds


@dataclass(frozen=True)
class FrameMeasures:
    """Of each frame: fine detail along the direction that has less of it, and how far the picture has moved so far.

    moved: sum of shifts, in pictures' widths.
    """

    detail: Float[Array, "n"]
    moved: Float[Array, "n"]


def write_frames(video: Path | str, out: Path | str, most: int = MOST_FRAMES) -> list[Path]:
    """Write the chosen frames of a video as JPEGs into the folder `out`, which is replaced. Returns their paths.

    Raises: InputError: no video, none that can be read, or the camera stands still.
    """
    measures = measure_frames(video)
    chosen = choose_frames(measures, most)
    if measures.moved[-1] < LEAST_MOTION or len(chosen) < 3:
        raise InputError(
            f"{video}: the camera hardly moves, so nothing can be said of distances; walk or fly along while filming"
        )
    blurred = int((measures.detail < find_threshold(measures.detail)).sum())
    _log.info("video: %d of %d frames chosen; %d are blurred", len(chosen), len(measures.detail), blurred)
    wanted, out = set(chosen.tolist()), Path(out)
    with atomic_folder(out) as part:
        part.mkdir(exist_ok=True)
        for number, frame in enumerate(_decode(video)):
            if number in wanted:
                frame.to_image().save(part / f"frame_{number:06d}.jpg", quality=95)
    return sorted(out.glob("*.jpg"))


def measure_frames(video: Path | str) -> FrameMeasures:
    """Detail and motion of every frame."""
    detail, moved, before = [], [0.0], None
    for frame in progress(_decode(video), "read frames"):
        grey = _shrink(frame)
        detail.append(measure_detail(grey))
        spectrum = _transform(grey)
        if before is not None:
            moved.append(moved[-1] + float(np.hypot(*find_shift(before, spectrum, grey.shape))) / grey.shape[1])
        before = spectrum
    if not detail:
        raise InputError(f"{video}: has no frames that can be read")
    return FrameMeasures(np.array(detail), np.array(moved))


def measure_detail(grey: Float32[Array, "h w"]) -> float:
    """The least share, over four directions, of the contrast between neighbouring pixels in that of pixels four apart.

    Motion blurs along one direction, and a lens out of focus along all; the ratio hardly depends on what is shown.
    """
    shares = []
    for dy, dx in ((0, 1), (1, 0), (1, 1), (1, -1)):
        near, far = (_contrast(grey, dy * step, dx * step) for step in (1, 4))
        shares.append(near / far if far > 0 else 0.0)
    return min(shares)


def find_threshold(detail: Float[Array, "n"]) -> float:
    """The detail below which a frame is blurred."""
    return BLUR * float(np.percentile(detail, USUAL))


def choose_frames(measures: FrameMeasures, most: int = MOST_FRAMES) -> Int[Array, "k"]:
    """The sharpest frame of each stretch of the way, blurred ones left out; at most `most` stretches."""
    step = max(STEP, measures.moved[-1] / most)
    stretch = (measures.moved / step).astype(int)
    sharp = measures.detail >= find_threshold(measures.detail)
    chosen = []
    for number in np.unique(stretch[sharp]):
        among = np.flatnonzero(sharp & (stretch == number))
        chosen.append(among[measures.detail[among].argmax()])
    return np.array(chosen[:most], int)


def find_shift(a: Array, b: Array, shape: tuple[int, int]) -> tuple[float, float]:
    """Rows and columns by which a picture has moved to another, from their spectra: the peak of phase correlation."""
    cross = a * np.conj(b)
    peak = fft.irfft2(cross / np.maximum(np.abs(cross), 1e-12), shape)
    row, column = np.unravel_index(peak.argmax(), shape)
    return _wrap(row, shape[0]), _wrap(column, shape[1])


def _wrap(index: np.intp, size: int) -> float:
    return float(index - size if index > size / 2 else index)


def _transform(grey: Float32[Array, "h w"]) -> Array:
    window = np.outer(np.hanning(grey.shape[0]), np.hanning(grey.shape[1])).astype(np.float32)
    return fft.rfft2((grey - grey.mean()) * window)


def _contrast(grey: Float32[Array, "h w"], dy: int, dx: int) -> float:
    h, w = grey.shape
    first = grey[: h - dy, max(0, -dx) : w - max(0, dx)]
    second = grey[dy:, max(0, dx) : w + min(0, dx)]
    return float(np.abs(second - first).mean())


def _shrink(frame: av.VideoFrame) -> Float32[Array, "h w"]:
    height = max(2, round(WIDTH * frame.height / frame.width))
    return frame.reformat(WIDTH, height, "gray", interpolation="AREA").to_ndarray().astype(np.float32) / 255


def _decode(video: Path | str) -> Iterator[av.VideoFrame]:
    """The frames of a video, in order. Raises: InputError: it cannot be read, is too large or too long."""
    try:
        with av.open(str(video)) as container:
            if not container.streams.video:
                raise InputError(f"{video}: has no pictures, only sound")
            stream = container.streams.video[0]
            stream.thread_type = "AUTO"
            if stream.width * stream.height > image_files.MAX_PIXELS:
                raise InputError(f"{video}: {stream.width} x {stream.height} pixels are too many")
            if container.duration and container.duration / av.time_base > LONGEST:
                raise InputError(f"{video}: longer than an hour; cut out the part that shows the ground")
            yield from container.decode(stream)
    except (av.FFmpegError, OSError) as error:
        raise InputError(f"{video}: not a video that can be read ({error})") from error
