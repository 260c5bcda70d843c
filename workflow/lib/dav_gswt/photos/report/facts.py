"""The facts of the photo report: how well each photo is registered, how often the ground is seen, what is weak."""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from jaxtyping import Float, Int
from numpy import ndarray as Array

from dav_gswt.geometry.georeference import Georeference
from dav_gswt.geometry.scene_frame import SceneFrame, read_scene_frame
from dav_gswt.photos import splitting
from dav_gswt.photos.colmap_model import (
    ColmapModel,
    count_shared_points,
    read_colmap_model,
    reprojection_errors,
    transform_model,
)
from dav_gswt.photos.ground_frame import Coverage, count_coverage
from dav_gswt.photos.sfm import focal_length

LEAST_POINTS, LEAST_SHARE = 100, 0.2  # points that hold a photo: as a number, and of the set's median
WORST_ERROR = 2.0  # pixels: a photo's mean, beyond which its place is doubtful or its lens another
WORST_MEAN = 1.0  # pixels: the set's mean, likewise
LEAST_SIDE = 0.5  # flying heights: of an exemplar that has room for tiles that differ
TOO_FEW = 0.02  # of the exemplar's cells that may be seen by fewer photos than are needed
COMPASS = ("north", "north-east", "east", "south-east", "south", "south-west", "west", "north-west")
ON_MAP = ("upper", "upper right", "right", "lower right", "lower", "lower left", "left", "upper left")


@dataclass(frozen=True)
class PhotoFacts:
    """points: how many hold it. error: their mean distance from where they should be, pixels; None without points.

    height: above z = 0, world units. tilt: degrees off straight down. partner, shared: the photo that shares most
    points with it, and how many; None where none does. linked: photos that share splitting.LINK or more. tests: it only
    tests, no point was sought in it. weak: in words.
    """

    name: str
    points: int
    error: float | None
    height: float
    tilt: float
    partner: str | None
    shared: int
    linked: int
    tests: bool
    weak: tuple[str, ...]


@dataclass(frozen=True)
class ReportFacts:
    """A scene's photos. need: photos that must see a place. cover: in world units, without those that only test."""

    scene: str
    frame: SceneFrame
    model: ColmapModel
    photos: tuple[PhotoFacts, ...]
    need: int
    cover: Coverage
    place: Georeference | None

    @property
    def exemplar(self) -> tuple[float, float, float]:
        square = self.frame.exemplar
        return square.west, square.south, square.side

    @property
    def placed(self) -> tuple[PhotoFacts, ...]:
        """The photos that are not there only to test."""
        return tuple(photo for photo in self.photos if not photo.tests)

    def length(self, of: float) -> str:
        """A length of the world, with its unit."""
        if self.frame.unit == "flying height":
            return f"{of:.2f} flying heights"
        return f"{of:.0f} m" if abs(of) >= 20 else f"{of:.1f} m"

    def range(self, low: float, high: float) -> str:
        """A range of lengths, with their unit."""
        first, last = self.length(low).split(" ", 1)[0], self.length(high)
        return f"{first} to {last}"


def collect_facts(folder: Path | str, scene: str) -> ReportFacts:
    """The facts of a photos/ folder. Raises: InputError: what it holds is not readable."""
    folder = Path(folder)
    frame, model = read_scene_frame(folder / "ground.json"), read_colmap_model(folder / "sparse")
    tests = set(frame.test or ())
    unit = frame.flying_height
    flat = transform_model(model, 1 / unit, np.eye(3), np.zeros(3))
    cameras = tuple(c for name, c in zip(model.names, flat.cameras, strict=True) if name not in tests)
    empty = Coverage(0.0, 0.0, 1.0, np.zeros((1, 1), int))
    grid = count_coverage(cameras, flat.points) if len(flat.points) else empty
    cover = replace(grid, west=unit * grid.west, south=unit * grid.south, cell=unit * grid.cell)
    need = frame.photos_per_cell or (3 if len(cameras) >= 9 else 2)
    return ReportFacts(scene, frame, model, assess_photos(model, tests), need, cover, frame.georeference)


def assess_photos(model: ColmapModel, tests: set[str]) -> tuple[PhotoFacts, ...]:
    """Each photo of the model, and what is weak about it. tests: names of those that only test."""
    shared, off = count_shared_points(model), reprojection_errors(model)
    points = np.diag(shared).copy()
    np.fill_diagonal(shared, 0)
    usual = np.median([n for n, name in zip(points, model.names, strict=True) if name not in tests] or [0])
    found = []
    for i, (name, camera) in enumerate(zip(model.names, model.cameras, strict=True)):
        own = off[model.image_of == i]
        most = int(shared[i].max())
        photo = PhotoFacts(
            name,
            int(points[i]),
            float(own.mean()) if len(own) else None,
            float(camera.centre[2]),
            float(np.degrees(np.arccos(np.clip(-camera.forward[2], -1, 1)))),
            model.names[int(shared[i].argmax())] if most else None,
            most,
            int((shared[i] >= splitting.LINK).sum()),
            name in tests,
            (),
        )
        found.append(photo if photo.tests else replace(photo, weak=find_weaknesses(photo, float(usual))))
    return tuple(found)


def find_weaknesses(photo: PhotoFacts, usual: float) -> tuple[str, ...]:
    """What is weak about a photo, in words. usual: the median number of points of the set's photos."""
    said = []
    if photo.points < max(LEAST_POINTS, LEAST_SHARE * usual):
        said.append(f"held by {photo.points} points only, others by about {usual:.0f}")
    if photo.error is not None and not photo.error <= WORST_ERROR:
        said.append(f"its points are {photo.error:.1f} px off on average")
    if photo.shared < splitting.LINK:
        said.append(f"shares at most {photo.shared} points with any other photo")
    return tuple(said)


def crop_to_exemplar(found: ReportFacts) -> Int[Array, "rows columns"]:
    """How many photos see each cell of the exemplar."""
    west, south, side = found.exemplar
    rows, columns = found.cover.counts.shape
    y = found.cover.south + (np.arange(rows) + 0.5) * found.cover.cell
    x = found.cover.west + (np.arange(columns) + 0.5) * found.cover.cell
    return found.cover.counts[np.ix_((y > south) & (y < south + side), (x > west) & (x < west + side))]


def describe_part(found: ReportFacts, east: int, north: int) -> str:
    """A ninth of the exemplar in words: -1, 0 or 1 to the east and to the north, of the compass where it is known."""
    if not (east or north):
        return "middle"
    if found.place:
        return f"{COMPASS[round(found.place.azimuth(np.array([east, north], float)) / 45) % 8]} part"
    return f"{ON_MAP[round(np.degrees(np.arctan2(east, north)) / 45) % 8]} part (as on the map)"


def list_weak_spots(found: ReportFacts) -> list[str]:
    """What is weak about the set, the worst first, in sentences that say what can be done."""
    return [
        *_warn_of_doubts(found),
        *_left_out(found),
        *_warn_of_thin_coverage(found),
        *_warn_of_weak_photos(found),
        *_unsure_lens(found),
        *_warn_of_small_exemplar(found),
    ]


def _warn_of_doubts(found: ReportFacts) -> list[str]:
    """What the verdict on structure from motion has against the model."""
    verdict = found.frame.verdict
    if verdict is None or verdict.grade == "good":
        return []
    reasons = "; ".join(sign.reason for sign in verdict.objections)
    return [f"The cameras are {verdict.grade}: {reasons}."]


def _left_out(found: ReportFacts) -> list[str]:
    out, total = len(found.frame.left_out), found.frame.images
    if not out:
        return []
    are = "photo was" if total == 1 else "photos were"
    return [
        f"{out} of {total} {are} left out: the reasons are below. More photos between them and the others can help."
    ]


def _warn_of_thin_coverage(found: ReportFacts) -> list[str]:
    """Parts of the exemplar that few photos see."""
    counts, said = crop_to_exemplar(found), []
    if min(counts.shape) < 3:
        return ["The exemplar is too small on the coverage map to say how often its parts are seen."]
    for i, band in enumerate(np.array_split(counts, 3, axis=0)):
        for j, part in enumerate(np.array_split(band, 3, axis=1)):
            typical = int(np.median(part))
            if typical <= found.need:
                many = "1 photo" if typical == 1 else f"{typical} photos"
                said.append(f"The {describe_part(found, j - 1, i - 1)} of the exemplar is mostly seen by {many} only.")
    short = float((counts < found.need).mean())
    if short > TOO_FEW and not said:
        said.append(f"{100 * short:.0f} % of the exemplar is seen by fewer than {found.need} photos.")
    return [f"{text} More photos of it make it sharper and surer." for text in said]


def _warn_of_weak_photos(found: ReportFacts) -> list[str]:
    weak = [photo.name for photo in found.photos if photo.weak]
    if not weak:
        return []
    names = ", ".join(weak[:5]) + (f" and {len(weak) - 5} more" if len(weak) > 5 else "")
    verb = "photo is" if len(weak) == 1 else "photos are"
    return [f"{len(weak)} {verb} weakly placed: {names}. If the field looks blurred there, try without."]


def _unsure_lens(found: ReportFacts) -> list[str]:
    said, frame = [], found.frame
    error = mean_reprojection_error(found)
    if error is not None and error > WORST_MEAN:
        said.append(f"Points are {error:.1f} px off on average: is every photo of one camera, unzoomed, and sharp?")
    lens = frame.focal
    if lens and lens.exif is None and lens.tilt < focal_length.OBLIQUE:
        said.append("The focal length is unsure, and heights with it: give the scene's `focal`, or add views aslant.")
    elif lens and lens.exif and lens.free:
        ratio = lens.free / lens.exif
        if abs(ratio - 1) > focal_length.HELD:
            said.append(f"The photos alone would say a focal length {ratio:.2f} times that of EXIF: are heights right?")
    return said


def _warn_of_small_exemplar(found: ReportFacts) -> list[str]:
    side = found.exemplar[2] / found.frame.flying_height
    if side >= LEAST_SIDE:
        return []
    return [f"The exemplar is only {side:.2f} flying heights wide: tiles will repeat soon. Photograph a larger place."]


def mean_reprojection_error(found: ReportFacts) -> float | None:
    """Mean reprojection error in pixels: as registration says it, else over the model's observations."""
    if found.frame.reprojection_error is not None:
        return found.frame.reprojection_error
    off = reprojection_errors(found.model)
    return float(off.mean()) if len(off) else None


def min_median_max(values: Float[Array, "n"] | Int[Array, "n"]) -> tuple[float, float, float]:
    """Least, median and greatest."""
    low, middle, high = np.percentile(values, [0, 50, 100]).tolist()
    return low, middle, high
