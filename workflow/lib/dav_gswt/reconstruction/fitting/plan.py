"""The plan of a fit: how many steps and Gaussians it may spend, and what happens at which step."""

from dataclasses import asdict, dataclass
from typing import Any

FEW_PHOTOS = 8  # that the steps of a preset are for; each further photo has steps of its own
FINAL_RATE = 0.1  # of the learning rates at the end of a fit, as a share of the full rates
EVENTS = 10  # of growth
GROWTH_END = 0.7  # of the steps
PRUNE_AT = 0.8  # of the steps; the rest makes up for what is pruned


def count_first_steps(steps: int, steps_per_photo: int, photos: int) -> int:
    """Steps of a first fit: `steps` for FEW_PHOTOS photos, and `steps_per_photo` for each photo more."""
    return steps + steps_per_photo * max(0, photos - FEW_PHOTOS)


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
    """What a fit did; `to_dict` gives fit.json."""

    steps: int = 0
    gaussians: int = 0

    def to_dict(self) -> dict[str, Any]:
        """For JSON."""
        return asdict(self)
