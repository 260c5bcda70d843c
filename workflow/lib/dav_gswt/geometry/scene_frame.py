"""The scene frame: the world coordinates of a scene, its exemplar and its extent, as ground.json stores them."""

from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Literal

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array

from dav_gswt.errors import InputError
from dav_gswt.files import read_record, write_json
from dav_gswt.geometry.georeference import Georeference
from dav_gswt.geometry.sun import CapturedSun


@dataclass(frozen=True)
class Square:
    """A square of the plane z = 0, its sides along x and y."""

    west: float
    south: float
    side: float

    @property
    def east(self) -> float:
        return self.west + self.side

    @property
    def north(self) -> float:
        return self.south + self.side

    @property
    def centre(self) -> Float[Array, "3"]:
        return np.array([self.west + self.side / 2, self.south + self.side / 2, 0.0])


@dataclass(frozen=True)
class Extent:
    """A rectangle of the plane z = 0."""

    west: float
    south: float
    east: float
    north: float


@dataclass(frozen=True)
class LeftOutPhoto:
    """A photo that was not registered, and why."""

    name: str
    reason: str


Grade = Literal["good", "doubtful", "refused"]


@dataclass(frozen=True)
class SfmSign:
    """A sign of whether a model of structure from motion is right. reason: a line that has the measured value."""

    name: str
    grade: Grade
    reason: str


@dataclass(frozen=True)
class SfmVerdict:
    """Whether a model of structure from motion can be trusted. tried: each way of mapping and what came of it."""

    grade: Grade
    signs: tuple[SfmSign, ...]
    tried: tuple[str, ...] = ()

    @property
    def objections(self) -> tuple[SfmSign, ...]:
        """The signs that are not good, the worst first."""
        return tuple(sign for grade in ("refused", "doubtful") for sign in self.signs if sign.grade == grade)

    def describe(self) -> str:
        """The grade and what speaks against the model, for a sentence."""
        return f"camera poses are {self.grade}, since {'; '.join(sign.reason for sign in self.objections)}"


@dataclass(frozen=True)
class FocalLength:
    """How the focal length of a photo set was settled; pixels, medians over its cameras.

    exif: None where no photo says. free: what bundle adjustment alone gives. tilt: of the views off the vertical,
    degrees, 95th percentile. decision: in words.
    """

    exif: float | None
    used: float
    free: float | None
    tilt: float
    decision: str

    @property
    def ratio(self) -> float | None:
        """The used focal length over EXIF's."""
        return self.used / self.exif if self.exif else None


@dataclass(frozen=True)
class SourceFrame:
    """Where the world lies in the file that it was imported from: a point p of the world is at origin + unit p @ axes.

    Double precision keeps UTM coordinates accurate to the millimetre.
    """

    origin: tuple[float, float, float]
    axes: tuple[tuple[float, float, float], tuple[float, float, float], tuple[float, float, float]]
    unit: float


@dataclass(frozen=True)
class SceneFrame:
    """A z-up world frame with the ground near z = 0, and how it came about.

    flying_height: median height of the cameras, in world units. exemplar: the square that tiles are made of. extent: of
    all ground that photos see. test, test_groups: names of photos that only test; None where the scene names none.
    relief: spread of the points about the plane, in flying heights. focal_ratio: the used focal length over EXIF's.
    reprojection_error: mean, pixels. points: of the sparse model. verdict: on structure from motion. sun: by EXIF,
    where time and place are known. gaussians, removed, source: of an imported field. renderer: versions of a synthetic
    scene's renderer.
    """

    kind: Literal["photos", "synthetic", "field"]
    unit: str
    flying_height: float
    exemplar: Square
    extent: Extent
    test: tuple[str, ...] | None = None
    test_groups: dict[str, tuple[str, ...]] | None = None
    georeference: Georeference | None = None
    relief: float | None = None
    images: int = 0
    registered: int = 0
    left_out: tuple[LeftOutPhoto, ...] = ()
    focal_ratio: float | None = None
    focal: FocalLength | None = None
    reprojection_error: float | None = None
    points: int | None = None
    verdict: SfmVerdict | None = None
    sun: CapturedSun | None = None
    gaussians: int | None = None
    removed: int | None = None
    source: SourceFrame | None = None
    renderer: dict[str, str | None] | None = None


def write_scene_frame(path: Path | str, frame: SceneFrame) -> None:
    """Write ground.json: what is None is left out."""
    write_json(path, {key: value for key, value in asdict(frame).items() if value is not None})


def read_scene_frame(path: Path | str) -> SceneFrame:
    """Read ground.json.

    Raises: InputError: not readable, a value is missing or of another type, an exemplar without area, or a
        georeference that no place on earth has.
    """
    frame = read_record(path, SceneFrame, "make the photos stage again")
    values = [*asdict(frame.exemplar).values(), *asdict(frame.extent).values(), frame.flying_height]
    if not np.isfinite(values).all() or not frame.exemplar.side > 0:
        problem = "not as the workflow writes it (the exemplar is no square)"
        raise InputError(f"{path}: {problem}; make the photos stage again")
    if frame.georeference and not frame.georeference.is_on_earth:
        raise InputError(f"{path}: its georeference is no place on earth; check the GPS positions of the photos")
    return frame
