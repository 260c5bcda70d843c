"""How long, how many, how rich: what a fit may spend, and what it found out that the scene requires."""

from dataclasses import dataclass, field
from typing import Literal

AUTO = "auto"
Count = int | Literal["auto"]  # a number, or: as many as the photos ask for

# Of a first fit whose steps are "auto": 8 photos, cap 500k, LPIPS of desert and meadow, for development: 56 .088, .335;
# 75 .086, .308. 150 were worse than 75 on desert, by .004 and .3 dB (before haze was pruned): they fit noise.
STEPS_PER_PHOTO = 75
# Of an update from 8 to 12 photos; the paper takes 5000. Meadow (development, cap 500k, degree 1): 40 23.47 dB, LPIPS
# .282; 80 23.43, .255; 160 23.26, .245. Desert, with a cap found: 40 33.34, .086; 80 33.32, .079.
STEPS_PER_NEW_PHOTO = 80
MOST_GAUSSIANS = 2_000_000  # of a fit that finds its own cap
MOST_DEGREE = 3  # of the spherical harmonics that a PLY can hold
TRIED_DEGREE = 1  # of a fit that finds its own


@dataclass(frozen=True)
class Plan:
    """What a fit may spend.

    steps: of the optimiser, one photo each. cap: most Gaussians; it grows towards it where the residual asks for more,
    with "auto" as long as errors are visible (`schedule.Schedule.cap`), to `most`. degree: of the spherical harmonics;
    reached one degree after the other, with "auto" kept if held-out pixels are better with it. half_share: share of the
    steps taken at half the resolution. pose_rate: radians (and distances over the mean depth) that a camera may turn a
    step, at the start; 0: none moves.
    """

    steps: int
    cap: Count
    degree: Count = 0
    half_share: float = 0.0
    pose_rate: float = 0.0
    most: int = MOST_GAUSSIANS

    def __post_init__(self):
        if self.steps < 0:
            raise ValueError(f"steps is {self.steps}; give a whole number from 0")
        for name, most in (("cap", None), ("degree", MOST_DEGREE)):
            value = getattr(self, name)
            if value != AUTO and (value < 0 or (most is not None and value > most)):
                raise ValueError(
                    f"{name} is {value}; give {AUTO!r} or a whole number" + (f" to {most}" if most else "")
                )
        if not 0 <= self.half_share < 1 or not self.pose_rate >= 0:
            raise ValueError(f"half_share is {self.half_share}, pose_rate {self.pose_rate}: shares and rates from 0")

    @property
    def most_degree(self) -> int:
        """Degree that the fit reaches, whether it is kept or not."""
        return TRIED_DEGREE if self.degree == AUTO else int(self.degree)


@dataclass
class Report:
    """What a fit did and why; `choices` tells each thing decided with its reason."""

    steps: int = 0
    gaussians: int = 0
    degree: int = 0
    choices: list[dict] = field(default_factory=list)
    held_out: list[dict] = field(default_factory=list)  # degree, psnr

    def chose(self, what: str, value, why: str) -> None:
        """Note a choice."""
        self.choices.append({"what": what, "value": value, "why": why})
