"""Frames of a video that structure from motion can use: sharp ones, each a little farther along than the one before.

Two passes over the video. The first measures frames, shrunk and grey: how sharp each is, and how far the picture has
moved. The second writes the chosen frames at full size, upright.
"""

import logging
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import av
import av.error
import numpy as np
from av.container import InputContainer
from av.stream import Disposition
from av.video.reformatter import ColorTrc
from jaxtyping import Bool, Float, Float32, Int
from numpy import ndarray as Array
from PIL import Image
from scipy import fft
from skimage.registration import phase_cross_correlation

from dav_gswt.errors import InputError
from dav_gswt.files import atomic_folder
from dav_gswt.images import image_files
from dav_gswt.images.srgb import Curve, convert_hdr
from dav_gswt.logs import progress
from dav_gswt.photos.photo_files import find_threshold

_log = logging.getLogger(__name__)

SIDE = 640  # pixels of the longer side at which frames are measured
# Cycles a pixel there: waves of 4 to 10 pixels of a photo of 960, and of 20 to 60.
FINE, COARSE = (0.15, 0.375), (0.025, 0.075)
SECTORS = 8  # directions of waves
SHRUNK = 4  # times coarser is the picture whose motion is measured
MOST_A_SECOND = 15  # frames that are measured: more are hardly farther along
MOST_FRAMES = 200
STEP = 0.15  # of a picture that the view moves on between chosen frames: five in six parts overlap
LOOSE = 0.4  # a step between chosen frames above which they may not hang together
LEAST_MOTION = 0.5  # pictures in all: less is a camera that stands still
LEAST_FRAMES = 3
BLUR = 0.25  # a frame with less than this share of the usual fine detail is blurred
HOP = 0.1  # of a picture that the view moves on until frames are compared with a new one
LONGEST = 3600.0  # seconds
HDR: dict[int, Curve] = {ColorTrc.ARIB_STD_B67: "hlg", ColorTrc.SMPTE2084: "pq"}
WHOLE = 0.98  # of the frames that the index lists: a video with fewer is cut short
FORMATS = "mov,mp4,m4a,3gp,3g2,mj2"  # no playlist, whose entries may be files anywhere


@dataclass(frozen=True)
class FrameMeasures:
    """Of each measured frame: its number in the video, the time at which it is shown (seconds), its fine detail (see
    `measure_detail`), and how far the picture has moved so far, in pictures."""

    number: Int[Array, "n"]
    time: Float[Array, "n"]
    detail: Float[Array, "n"]
    moved: Float[Array, "n"]


def write_frames(video: Path | str, out: Path | str, threads: int = 1, most: int = MOST_FRAMES) -> list[Path]:
    """Write the chosen frames of a video as JPEGs into the folder `out`, which is replaced. Returns their paths.

    Of a video that is damaged or cut short, the frames up to there count. threads: of the decoder; changes no result.
    Raises: InputError: no video, none that can be read, too long, or the camera stands still.
    """
    measures, out = measure_frames(video, threads), Path(out)
    chosen = choose_frames(measures, most)
    if measures.moved.max() < LEAST_MOTION:
        raise InputError(f"{video}: the camera stands still, which tells no distances; walk or fly along while filming")
    if len(chosen) < LEAST_FRAMES:
        raise InputError(f"{video}: only {len(chosen)} sharp frames; film in more light, or move more slowly")
    _report_choice(video, measures, chosen, most)
    numbers = set(measures.number[chosen].tolist())
    with atomic_folder(out) as part:
        for number, frame in _decode(video, threads):
            if number in numbers:
                _develop(frame, threads).save(part / f"frame_{number:06d}.jpg", quality=95)
            if number == max(numbers):
                break
    return sorted(out.glob("*.jpg"))


def measure_frames(video: Path | str, threads: int = 1) -> FrameMeasures:
    """Detail and motion of the frames, of at most MOST_A_SECOND a second. Raises: InputError: as `write_frames`."""
    rows, motion = [], MotionMeter()
    for number, frame in _decode(video, threads, report=True):
        time = float(number if frame.time is None else frame.time)
        if rows and 0 <= time - rows[-1][1] < 0.99 / MOST_A_SECOND:
            continue
        detail = measure_detail(_shrink(frame, SIDE, threads))
        rows.append((number, time, detail, motion.follow(_shrink(frame, SIDE // SHRUNK, threads))))
    if not rows:
        raise InputError(f"{video}: has no frame that can be read; copy it again, or export it as MP4")
    number, time, detail, moved = zip(*rows, strict=True)
    return FrameMeasures(np.array(number), np.array(time), np.array(detail), np.array(moved))


def measure_detail(grey: Float32[Array, "h w"]) -> float:
    """The power of fine waves over that of coarse ones, in the direction that has least.

    Motion blurs along one direction, a lens out of focus along all. Frames that show much the same are told apart more
    clearly than by `sharpness.measure_detail`, which depends less on what is shown.
    """
    fine, coarse, sector = _split_waves(*grey.shape)
    faded = (grey - grey.mean()) * _make_window(*grey.shape)
    power = np.abs(fft.rfft2(faded)) ** 2
    known = np.bincount(sector, power[fine], SECTORS) / np.maximum(np.bincount(sector, minlength=SECTORS), 1)
    usual = float(power[coarse].mean()) if coarse.any() else 0.0
    return float(known.min()) / usual if usual > 0 else 0.0


@lru_cache(maxsize=1)
def _split_waves(height: int, width: int) -> tuple[Bool[Array, "h k"], Bool[Array, "h k"], Int[Array, "_"]]:
    """Which waves of a spectrum are fine, which are coarse, and in which of SECTORS directions each fine one runs."""
    y, x = fft.fftfreq(height)[:, None], fft.rfftfreq(width)[None, :]
    wave, angle = np.hypot(x, y), np.arctan2(y, x + 0 * y) % np.pi
    fine, coarse = ((wave >= low) & (wave < high) for low, high in (FINE, COARSE))
    return fine, coarse, np.minimum((angle[fine] * SECTORS / np.pi).astype(int), SECTORS - 1)


@lru_cache(maxsize=2)
def _make_window(height: int, width: int) -> Float32[Array, "h w"]:
    """What lets a picture fade out towards its border."""
    return np.outer(np.hanning(height), np.hanning(width)).astype(np.float32)


class MotionMeter:
    """Measures how far the picture of a video has moved, frame by frame.

    The way is the sum of shifts, each against a frame some way back and not the one before: so slow motion counts, and
    a hand that trembles on the spot does not.
    """

    def __init__(self):
        self._behind: Float32[Array, "h w"] | None = None
        self._way = 0.0

    def follow(self, grey: Float32[Array, "h w"]) -> float:
        """The way up to the next frame, in pictures."""
        faded = (grey - grey.mean()) * _make_window(*grey.shape)
        if not faded.any():  # a black frame
            return self._way
        if self._behind is None:
            self._behind = faded
        moved, _, _ = phase_cross_correlation(self._behind, faded)
        shift = float(np.linalg.norm(moved / grey.shape))
        if shift < HOP:
            return self._way + shift
        self._behind, self._way = faded, self._way + shift
        return self._way


def _shrink(frame: av.VideoFrame, side: int, threads: int) -> Float32[Array, "h w"]:
    """A frame in grey, at most `side` pixels along the longer side."""
    size = image_files.fit_size(frame.width, frame.height, side)
    return frame.reformat(*size, "gray", interpolation="AREA", threads=threads).to_ndarray().astype(np.float32)


def choose_frames(measures: FrameMeasures, most: int = MOST_FRAMES) -> Int[Array, "k"]:
    """The sharpest frame of each stretch of the way, blurred ones left out; at most `most` stretches."""
    step = max(STEP, float(measures.moved.max()) / most)
    stretch = np.minimum((measures.moved / step).astype(int), most - 1)
    sharp = measures.detail >= find_threshold(measures.detail, BLUR)
    chosen = []
    for number in np.unique(stretch[sharp]):
        among = np.flatnonzero(sharp & (stretch == number))
        chosen.append(among[measures.detail[among].argmax()])
    return np.array(sorted(chosen), int)


def _develop(frame: av.VideoFrame, threads: int) -> Image.Image:
    """A frame as a picture, upright; HDR as a usual one."""
    if curve := HDR.get(frame.color_trc):
        image = Image.fromarray(convert_hdr(frame.to_ndarray(format="rgb48le", threads=threads), curve))
    else:
        image = frame.to_image(threads=threads)
    return image.rotate(frame.rotation, expand=True)


def _report_choice(video: Path | str, measures: FrameMeasures, chosen: Int[Array, "k"], most: int) -> None:
    blurred = measures.detail < find_threshold(measures.detail, BLUR)
    _log.info(
        "%s: %d frames chosen of %d that were measured, %d of which are blurred",
        *(video, len(chosen), len(blurred), blurred.sum()),
    )
    ends = np.r_[0, chosen, len(blurred) - 1]
    for first, last in zip(ends[:-1], ends[1:], strict=True):
        step, dim = float(measures.moved[last] - measures.moved[first]), bool(blurred[first + 1 : last].any())
        if step > LOOSE and dim:
            when = "from {:.0f} s to {:.0f} s".format(*measures.time[[first, last]])
            _log.warning("%s: is blurred %s, and what it shows there is missing", video, when)
    if (step := float(measures.moved.max()) / most) > LOOSE:
        _log.warning(
            "%s: the way is long: %d frames overlap by %.0f %% only; cut the video into parts",
            *(video, most, 100 * max(0.0, 1 - step)),
        )


@contextmanager
def _open(video: Path | str) -> Iterator[InputContainer]:
    """Raises: InputError: the file is no video, or its index is missing."""
    try:
        options = {"format_whitelist": FORMATS}
        container = av.open(str(Path(video).resolve()), container_options=options, metadata_errors="replace")
    except (av.error.FFmpegError, OSError) as error:
        raise InputError(
            f"{video}: not a video that can be read ({error.strerror}); if it was cut short its index is lost: copy it "
            "again, or have it repaired"
        ) from error
    with container:
        yield container


def _decode(video: Path | str, threads: int, report: bool = False) -> Iterator[tuple[int, av.VideoFrame]]:
    """The frames of a video with their numbers, up to its end or to where it is damaged. report: say how far it is.

    The decoder invents what is lost, and says of which frames; of some faults that cameras write it only warns.
    Raises: InputError: it cannot be read, is too large or too long.
    """
    with _open(video) as container:
        streams = [s for s in container.streams.video if not s.disposition & Disposition.attached_pic]
        if not streams:
            raise InputError(f"{video}: has no moving pictures, only sound")
        stream = streams[0]
        if stream.width * stream.height > image_files.MAX_PIXELS:
            raise InputError(f"{video}: {stream.width} x {stream.height} pixels are too many")
        context = stream.codec_context
        context.thread_type, context.thread_count = "FRAME", threads
        context.options = {"err_detect": "careful", "max_pixels": str(image_files.MAX_PIXELS)}
        _require_short(video, (container.duration or 0) / av.time_base)
        time, count = 0.0, 0
        with progress(range(stream.frames if report else 0), "read frames") as bar:
            try:
                for frame in container.decode(stream):
                    if frame.is_corrupt and count:
                        break
                    if frame.is_corrupt:  # before the first whole one
                        continue
                    time, count = frame.time or time, count + 1
                    _require_short(video, time)
                    yield count - 1, frame
                    bar.update(int(report))
                whole = count >= WHOLE * stream.frames
            except (av.error.FFmpegError, OSError):
                whole = False
        if report and count and not whole:
            _log.warning("%s: is damaged or cut short after %.1f s; frames up to there are used", video, time)


def _require_short(video: Path | str, seconds: float) -> None:
    if seconds > LONGEST:
        raise InputError(f"{video}: longer than an hour; cut out the part that shows the ground")
