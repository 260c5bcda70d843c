"""Survey flights over an unknown scene: circles at several heights above the ground.

`python -m dav_gswt.capture.survey start ...` plans the few photos that a scene starts from, `... exhaustive ...` enough
to show every place from every direction, as a pool for later rounds.
"""

import argparse
import sys
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array

from dav_gswt.capture import qgc_plan
from dav_gswt.errors import InputError
from dav_gswt.files import write_json
from dav_gswt.geometry import camera_layouts
from dav_gswt.geometry.cameras import Camera
from dav_gswt.geometry.georeference import Georeference
from dav_gswt.photos.sfm import gps

ELEVATION = 65.0  # degrees: of the circles of a start flight
ELEVATIONS = (90.0, 65.0, 45.0)  # of an exhaustive flight
LOWER = 0.5  # second height of an exhaustive flight, as a share of the first
MARGIN = 1.1  # of the square, in a photo from straight above at the chosen height
ACROSS = 32  # rays across a photo by which overlap is measured
TURN = 30.0  # greatest angle between viewing directions of neighbours, degrees: beyond, features do not match
MOST = 2000  # photos in all
MINUTES = 20.0  # flight time of one battery, with reserve


@dataclass(frozen=True)
class Lens:
    """A lens. fov: field of view of the longer side, degrees. aspect: longer over shorter side."""

    fov: float = 73.7  # 24 mm on 36 x 24 mm: what most drones have
    aspect: float = 4 / 3

    @property
    def half_tangent(self) -> float:
        """Tangent of half the field of view of the shorter side."""
        return float(np.tan(np.radians(self.fov) / 2)) / self.aspect

    def camera(self, elevation: float, azimuth: float, height: float, aim: float) -> Camera:
        """Camera at `height` above the ground that looks inwards at a point `aim` from the middle.

        elevation: 90 looks straight down. azimuth: of camera and point from the middle, from +x towards +y.
        """
        target = aim * np.array([np.cos(np.radians(azimuth)), np.sin(np.radians(azimuth)), 0.0])
        radius = height / np.sin(np.radians(elevation))
        return camera_layouts.orbit(elevation, azimuth, radius, target, ACROSS, round(ACROSS / self.aspect), self.fov)


def plan_start(n: int, heights: list[float], lens: Lens, overlap: float = 0.7) -> list[qgc_plan.NamedCamera]:
    """Plan n photos of the middle: one from straight above at the greatest height, the others on circles at ELEVATION.

    Every height has one circle; the circles share the photos evenly and are rotated against each other.
    Raises: InputError: neighbours on a circle overlap less than `overlap`, with the number that is enough.
    """
    enough = [photos_per_circle(ELEVATION, height, 0.0, lens, overlap) for height in heights]
    counts = [(n - 1 + i) // len(heights) for i in range(len(heights))]
    if any(got < least for got, least in zip(counts, enough, strict=True)):
        least = 1 + len(heights) * max(enough)
        raise InputError(f"neighbours of {n} photos overlap by less than {overlap:.0%}; take at least {least}")
    cameras = [lens.camera(90.0, 90.0, max(heights), 0.0)]
    for k, (height, m) in enumerate(zip(heights, counts, strict=True)):
        cameras += [lens.camera(ELEVATION, 360.0 * (i + k / len(heights)) / m, height, 0.0) for i in range(m)]
    return _name_cameras(cameras)


def plan_exhaustive(
    side: float, heights: list[float], lens: Lens, elevations: tuple[float, ...] = ELEVATIONS, overlap: float = 0.7
) -> list[qgc_plan.NamedCamera]:
    """Plan circles that show all of a square, for every height and elevation; neighbours overlap by `overlap`.

    The cameras of a circle look inwards at a circle on the ground. Photos overlap across these circles as along them;
    on the outermost the square's corners are half a photo inside.
    Raises: InputError: more than MOST photos are needed.
    """
    cameras = []
    for height in heights:
        for elevation in elevations:
            for aim in aim_radii(side, height, elevation, lens, overlap):
                n = photos_per_circle(elevation, height, aim, lens, overlap)
                cameras += [lens.camera(elevation, 360.0 * i / n, height, aim) for i in range(n)]
                if len(cameras) > MOST:
                    raise _too_many_photos(overlap)
    return _name_cameras(cameras)


def aim_radii(side: float, height: float, elevation: float, lens: Lens, overlap: float) -> list[float]:
    """Radii of the circles on the ground that cameras look at, evenly spaced from 0."""
    last = max(0.0, side / 2**0.5 - height * lens.half_tangent / 2)
    if last == 0:
        return [0.0]
    for n in range(1, MOST):
        if _overlap_enough(
            lens.camera(elevation, 0.0, height, 0.0), lens.camera(elevation, 0.0, height, last / n), overlap
        ):
            return [last * i / n for i in range(n + 1)]
    raise _too_many_photos(overlap)


def photos_per_circle(elevation: float, height: float, aim: float, lens: Lens, overlap: float) -> int:
    """Least number of photos on a circle whose neighbours overlap enough; 1 from straight above."""
    if elevation >= 90 and aim == 0:
        return 1
    first = lens.camera(elevation, 0.0, height, aim)
    for n in range(3, MOST + 1):
        if _overlap_enough(first, lens.camera(elevation, 360.0 / n, height, aim), overlap):
            return n
    raise _too_many_photos(overlap)


def split_flights(
    views: list[qgc_plan.NamedCamera],
    place: Georeference,
    home: Float[Array, "2"],
    rules: qgc_plan.FlightRules,
    minutes: float,
) -> list[qgc_plan.SurveyFlight]:
    """Plan one flight past all views, or the fewest that each take at most `minutes`.

    The flights divide the views in the order of the single flight. Raises: InputError: a single view takes longer.
    """
    whole = qgc_plan.plan_flight(views, place, home, rules)
    ordered = [(name, dict(views)[name]) for name in whole.names]
    for n in range(int(np.ceil(whole.duration / 60 / minutes)), len(views) + 1):
        ends = [len(views) * i // n for i in range(n + 1)]
        found = [qgc_plan.plan_flight(ordered[a:b], place, home, rules) for a, b in pairwise(ends)]
        if max(flown.duration for flown in found) <= 60 * minutes:
            return found
    raise InputError(f"to fly to one photo and back takes longer than {minutes:g} min; fly faster, or from nearer")


def _too_many_photos(overlap: float) -> InputError:
    return InputError(
        f"more than {MOST} photos are needed for an overlap of {overlap:.0%}; ask for less, or fly higher"
    )


def overlap_share(a: Camera, b: Camera) -> float:
    """Share of the ground pixels of photo a that photo b shows too; 0 if a shows no ground."""
    origin, step = a.rays()
    falls = step[..., 2] < -1e-6
    if not falls.any():
        return 0.0
    origin, step = origin[falls], step[falls]
    ground = origin - origin[:, 2:] / step[:, 2:] * step
    pixels, depth = b.project(ground)
    inside = (depth > 0) & (pixels >= 0).all(1) & (pixels <= [b.width, b.height]).all(1)
    return float(inside.mean())


def covering_height(side: float, lens: Lens) -> float:
    """Height from which a photo straight down shows a square with a margin."""
    return MARGIN * side / 2 / lens.half_tangent


def _overlap_enough(a: Camera, b: Camera, overlap: float) -> bool:
    apart = np.degrees(np.arccos(np.clip(a.forward @ b.forward, -1, 1)))
    return min(overlap_share(a, b), overlap_share(b, a)) >= overlap and bool(apart <= TURN + 1e-6)


def _name_cameras(cameras: list[Camera]) -> list[qgc_plan.NamedCamera]:
    return [(f"photo_{i:04d}", camera) for i, camera in enumerate(cameras)]


def count_least_views(views: list[qgc_plan.NamedCamera], side: float, cells: int = 9) -> int:
    """Least number of photos in which a place of the square is visible."""
    at = (np.arange(cells) / (cells - 1) - 0.5) * side
    ground: Float[Array, "n 3"] = np.stack([*np.meshgrid(at, at), np.zeros((cells, cells))], -1).reshape(-1, 3)
    count = np.zeros(len(ground), int)
    for _, camera in views:
        pixels, depth = camera.project(ground)
        count += (depth > 0) & (pixels >= 0).all(1) & (pixels <= [camera.width, camera.height]).all(1)
    return int(count.min())


def describe_missing_spread(views: list[qgc_plan.NamedCamera]) -> str | None:
    """What to change where the photos are taken so near to each other that GPS cannot place them; None: nothing."""
    spread, _ = gps.measure_spread(np.array([camera.centre for _, camera in views]))
    least = gps.LEAST_SPREAD * gps.ACROSS
    if spread >= least:
        return None
    times = np.ceil(100 * least / max(spread, 1e-6)) / 100
    return (
        f"These photos are taken within {spread:.1f} m, which is within the error of GPS receivers: their positions "
        f"will give neither scale nor north, and no mission can be flown to further poses. --heights or --side "
        f"{times:.2f} times as large give the {least:.0f} m that it takes."
    )


def plan_from_options(options: argparse.Namespace) -> tuple[list[qgc_plan.SurveyFlight], list[qgc_plan.NamedCamera]]:
    """Plan the flights of the command line. Raises: InputError: impossible options, with what is possible."""
    lens, side = Lens(options.fov, options.aspect), options.side
    full = covering_height(side, lens)
    if options.kind == "start":
        heights = options.heights or [full]
        if max(heights) < full / MARGIN * (1 - 1e-9):
            raise InputError(
                f"from {max(heights):g} m a photo does not show a square of {side:g} m; fly at {full:.1f} m or higher, "
                "or take a smaller square"
            )
        views = plan_start(options.photos, heights, lens, options.overlap)
    else:
        heights = options.heights or [full, LOWER * full]
        views = plan_exhaustive(side, heights, lens, tuple(options.elevations), options.overlap)
    place = Georeference(options.latitude, options.longitude, options.altitude, options.north, 1.0)
    rules = qgc_plan.FlightRules(options.min_altitude, options.clearance, options.speed)
    return split_flights(views, place, np.array([0.0, -side / 2]), rules, options.minutes), views


def make_parser() -> argparse.ArgumentParser:
    """Build the command line parser."""
    parser = argparse.ArgumentParser(prog="python -m dav_gswt.capture.survey", description=__doc__)
    parser.add_argument("kind", choices=["start", "exhaustive"])
    parser.add_argument("out", type=Path, help="the mission to write, for example start.plan")
    needed = parser.add_argument_group("where (the middle of the square)")
    needed.add_argument("--latitude", type=_number_type(-89, 89), required=True, help="degrees, WGS84")
    needed.add_argument("--longitude", type=_number_type(-180, 180), required=True, help="degrees, WGS84")
    needed.add_argument(
        "--altitude", type=_number_type(-500, 9000), required=True, help="of the ground: metres above sea"
    )
    needed.add_argument("--side", type=_number_type(0.5, 2000), required=True, help="of the square: metres")
    needed.add_argument(
        "--north", type=_number_type(-360, 360), default=0.0, help="how it is turned: its side's azimuth"
    )
    what = parser.add_argument_group("what")
    low, high, many = (_number_type(*bounds) for bounds in ((15, 90), (0.5, 500), (0.1, 0.95)))
    what.add_argument("--heights", type=high, nargs="+", metavar="M", help="of the circles: metres above the ground")
    what.add_argument("--elevations", type=low, nargs="+", metavar="DEG", default=ELEVATIONS, help="exhaustive only")
    what.add_argument("--photos", type=int, default=8, help="start only: in all")
    what.add_argument("--overlap", type=many, default=0.7, help="of neighbours, as a share")
    what.add_argument("--fov", type=_number_type(10, 130), default=Lens.fov, help="of the longer side: degrees")
    what.add_argument("--aspect", type=_number_type(1, 3), default=Lens.aspect, help="longer over shorter side")
    safe = parser.add_argument_group("safety")
    safe.add_argument(
        "--min-altitude", type=_number_type(0, 100), default=qgc_plan.FlightRules.min_altitude, help="metres"
    )
    safe.add_argument("--clearance", type=_number_type(1, 100), default=qgc_plan.FlightRules.clearance, help="metres")
    safe.add_argument(
        "--minutes", type=_number_type(1, 600), default=MINUTES, help="longer flights become several files"
    )
    safe.add_argument("--speed", type=_number_type(0.1, 20), default=qgc_plan.FlightRules.speed, help="metres a second")
    return parser


def _number_type(least: float | int, most: float | int):
    def number(text: str) -> float:
        value = float(text)
        if not least <= value <= most:
            raise argparse.ArgumentTypeError(f"{text} is not between {least:g} and {most:g}")
        return value

    return number


def main(arguments: list[str] | None = None) -> int:
    """Write a plan and print a summary. Returns the exit status."""
    options = make_parser().parse_args(arguments)
    try:
        flown, views = plan_from_options(options)
        paths = [options.out]
        if len(flown) > 1:
            paths = [options.out.with_stem(f"{options.out.stem}_{i + 1}") for i in range(len(flown))]
        for path, flight in zip(paths, flown, strict=True):
            write_json(path, flight.content)
            print(f"{path}: {len(flight.names)} photos, {flight.describe()}")
    except (InputError, OSError) as error:
        print(error, file=sys.stderr)
        return 1
    if advice := describe_missing_spread(views):
        print(advice)
    fewest = count_least_views(views, options.side)
    print(
        f"Every place of the square is in {fewest} or more. Take off from the ground near {flown[0].describe_home()}."
    )
    return 0


if __name__ == "__main__":
    sys.exit(main())
