"""The plan of a fit: what a preset lets it spend, and what happens at which step."""

from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from typing import Any

from dav_gswt.reconstruction import discs

FEW_PHOTOS = 8  # that the steps of a preset are for; each further photo has steps of its own
FINAL_RATE = 0.1  # of the learning rates at the end of a fit, as a share of the full rates
EVENTS = 10  # of growth
GROWTH_END = 0.7  # of the steps
PRUNE_AT = 0.8  # of the steps; the rest makes up for what is pruned
# Learning rates of an update at its first step, as a share of a first fit's: the field is nearly right, and full rates
# would undo its detail faster than a round's few steps make it again (docs/active-views.md)
UPDATE_RATE = 0.3
GROUND_SHARE = 0.9  # of the Gaussians, that the ground may take with its underlay; objects get the rest


@dataclass(frozen=True)
class FitPlan:
    """What a fit may spend.

    steps: of the optimiser, one photo each. max_gaussians: approached where the errors ask for more. sh_degree: of the
    spherical harmonics, added degree by degree. first_rate: share of the full learning rates to begin with.
    """

    steps: int
    max_gaussians: int
    sh_degree: int = 0
    first_rate: float = 1.0


@dataclass(frozen=True, kw_only=True)
class FitSettings:
    """The keys of a preset that the first fit and its updates read.

    fit_size: longer side of the photos, pixels. spacing: of the discs, in sizes of a photo's pixel on the ground.
    steps: of the first fit. steps_per_photo: of the first fit for each photo beyond FEW_PHOTOS, and of an update for
    each new photo.
    """

    fit_size: int
    spacing: float
    max_gaussians: int
    steps: int
    steps_per_photo: int = 0
    sh_degree: int = 0

    @staticmethod
    def from_preset(preset: Mapping[str, Any]) -> "FitSettings":
        """The settings of a preset, which may have keys for other stages."""
        return FitSettings(**{each.name: preset[each.name] for each in fields(FitSettings) if each.name in preset})

    def from_scratch(self, start: int, photos: int) -> "FitSettings":
        """The settings of one fit with as many steps as a fit to `start` photos and updates to `photos` take."""
        steps = self.plan_coarse_fit(start).steps + self.steps_per_photo * max(0, photos - start)
        return replace(self, steps=steps, steps_per_photo=0)

    def plan_coarse_fit(self, photos: int) -> FitPlan:
        """The plan of the first fit, to so many photos."""
        steps = self.steps + self.steps_per_photo * max(0, photos - FEW_PHOTOS)
        return FitPlan(steps, self.max_gaussians, self.sh_degree)

    def plan_update(self, earlier: int, new: int) -> FitPlan:
        """The plan of an update of a field from so many earlier photos with so many new ones."""
        first_rate = UPDATE_RATE if earlier else 1.0
        return FitPlan(self.steps_per_photo * new, self.max_gaussians, self.sh_degree, first_rate)


def limit_discs(max_gaussians: int) -> int:
    """Most cells of the ground's grid in a field of so many Gaussians."""
    return int(GROUND_SHARE * max_gaussians / (1 + 1 / discs.STRIDE**2))


@dataclass(frozen=True)
class Schedule:
    """What happens at which step of a fit that begins with `start` Gaussians.

    If these are `max_gaussians` or more, no Gaussian is moved, added or pruned, as in the fit of a level.
    """

    plan: FitPlan
    start: int

    def rate(self, step: int) -> float:
        """Factor of all learning rates: the plan's first, falling to FINAL_RATE."""
        first = self.plan.first_rate
        return first * (FINAL_RATE / first) ** (step / max(1, self.plan.steps))

    def to_growth(self, step: int) -> int | None:
        """Steps to the next growth event; 0: it is due now; None: there is none left."""
        due = max(1, -(-step // self._every)) * self._every
        return due - step if self._grows and due <= GROWTH_END * self.plan.steps else None

    def prunes(self, step: int) -> bool:
        """Whether Gaussians are pruned at this step."""
        return self._grows and step == int(PRUNE_AT * self.plan.steps)

    def max_gaussians(self, step: int, now: int) -> int:
        """Number of Gaussians allowed after the growth event at this step, which begins with `now`."""
        events = int(self.plan.steps * GROWTH_END) // self._every
        left = max(1, events - step // self._every + 1)
        return now + max(0, self.plan.max_gaussians - now) // left

    @property
    def _grows(self) -> bool:
        return self.plan.max_gaussians > self.start

    @property
    def _every(self) -> int:
        return max(1, int(self.plan.steps * GROWTH_END) // EVENTS)


@dataclass
class FitReport:
    """What a fit did; its fields are those of fit.json."""

    steps: int = 0
    gaussians: int = 0
