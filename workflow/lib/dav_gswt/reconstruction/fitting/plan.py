"""What a fit may spend, and its report."""

from dataclasses import asdict, dataclass, field
from typing import Any, Literal

AUTO = "auto"
Count = int | Literal["auto"]  # a number, or as many as the photos ask for

STEPS_PER_PHOTO = 38  # of a first fit with "auto"
STEPS_PER_NEW_PHOTO = 40  # of an update with "auto"; the paper takes 5000 steps
FEW_PHOTOS = 8  # that the steps of a preset are for; each further photo has steps of its own
MAX_GAUSSIANS = 2_000_000  # of a fit that finds its own number
MAX_SH_DEGREE = 3  # that a PLY can hold
TRIED_SH_DEGREE = 1  # by a fit that finds its own


def count_first_steps(steps: Count, steps_per_photo: Count, photos: int) -> int:
    """Steps of a first fit to so many photos, by a preset's `steps` and `steps_per_photo`.

    `steps` are for FEW_PHOTOS; each photo more adds as many steps as a new photo of a round.
    """
    if steps == AUTO:
        return STEPS_PER_PHOTO * photos
    further = STEPS_PER_NEW_PHOTO if steps_per_photo == AUTO else int(steps_per_photo)
    return int(steps) + further * max(0, photos - FEW_PHOTOS)


@dataclass(frozen=True)
class FitPlan:
    """What a fit may spend.

    steps: of the optimiser, one photo each. max_gaussians: approached where the residual asks for more; with "auto"
    their number grows as long as errors are visible (see `schedule.Schedule.max_gaussians`), up to `limit`.
    sh_degree: of the spherical harmonics, added degree by degree; with "auto" the lowest that held-out pixels need.
    half_share: share of the steps at half the resolution. pose_rate: radians (and distances over the mean depth) that a
    camera may turn a step, at the start; 0: cameras stay. first_rate: share of full learning rates to begin with.
    """

    steps: int
    max_gaussians: Count
    sh_degree: Count = 0
    half_share: float = 0.0
    pose_rate: float = 0.0
    limit: int = MAX_GAUSSIANS
    first_rate: float = 1.0

    def __post_init__(self):
        if self.steps < 0:
            raise ValueError(f"steps is {self.steps}; give a whole number from 0")
        for name, most in (("max_gaussians", None), ("sh_degree", MAX_SH_DEGREE)):
            value = getattr(self, name)
            if value != AUTO and (value < 0 or (most is not None and value > most)):
                raise ValueError(
                    f"{name} is {value}; give {AUTO!r} or a whole number" + (f" to {most}" if most else "")
                )
        if not 0 < self.first_rate <= 1:
            raise ValueError(f"first_rate is {self.first_rate}; give a share above 0, at most 1")
        if not 0 <= self.half_share < 1 or not self.pose_rate >= 0:
            raise ValueError(f"half_share is {self.half_share}, pose_rate {self.pose_rate}: shares and rates from 0")

    @property
    def max_sh_degree(self) -> int:
        """Degree that the fit reaches, whether it is kept or not."""
        return TRIED_SH_DEGREE if self.sh_degree == AUTO else int(self.sh_degree)


@dataclass
class FitReport:
    """What a fit did; `to_dict` gives fit.json."""

    steps: int = 0
    gaussians: int = 0
    degree: int | None = 0  # of the spherical harmonics; None without a fit
    choices: list[dict[str, Any]] = field(default_factory=list)  # what, value, why
    held_out: list[dict[str, Any]] = field(default_factory=list)  # degree, psnr

    def note_choice(self, what: str, value: Any, why: str) -> None:
        self.choices.append({"what": what, "value": value, "why": why})

    def to_dict(self) -> dict[str, Any]:
        """For JSON. Without a fit there is no degree."""
        found = asdict(self)
        if self.degree is None:
            del found["degree"]
        return found


@dataclass(frozen=True)
class EarlierViews:
    """How an update changed the PSNR (dB) of the photos before it."""

    photos: int
    psnr_before: float | None
    psnr_after: float | None
    psnr_of_fits: list[float | None]
    lost: float
    bound: float
    handed_on: str


@dataclass(frozen=True)
class NewViews:
    """How an update changed the PSNR (dB) of its own photos. taken: whether the field was fitted to them."""

    photos: int
    taken: bool
    psnr_before: float | None
    psnr_after: float | None
    views: list[dict[str, Any]]  # view, psnr_before, psnr_after


@dataclass
class UpdateReport(FitReport):
    """What an update did, over all its fits."""

    earlier_views: EarlierViews | None = None  # None without new photos
    new_views: NewViews | None = None
