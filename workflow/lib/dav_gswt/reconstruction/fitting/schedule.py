"""The schedule of a fit: learning rates, growth of the number of Gaussians, pruning."""

from dataclasses import dataclass

from dav_gswt.reconstruction.fitting.plan import AUTO, FitPlan

FINAL_RATE = 0.1  # of the rates at the start
EVENTS = 10  # of growth
GROWTH_END = 0.7  # of the steps
PRUNE_AT = 0.8  # of the steps; the rest makes up for what is pruned
GROWTH = 0.4  # of the Gaussians, at most added at the first event with "auto", a tenth of it at the last
VISIBLE = 0.011  # error of a pixel, of colours 0 to 1, that justifies a Gaussian with "auto"


@dataclass(frozen=True)
class Schedule:
    """start: Gaussians that the fit begins with. With `max_gaussians` of them none is moved, added or pruned, as in the
    fit of a level."""

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

    def max_gaussians(self, step: int, now: int, error: float) -> int:
        """Number of Gaussians allowed after the growth event at this step.

        error: squared error of a photo, summed over the Gaussians; with "auto" each VISIBLE**2 of it justifies one.
        """
        events = int(self.plan.steps * GROWTH_END) // self._every
        left = max(1, events - step // self._every + 1)
        if self.plan.max_gaussians == AUTO:
            soon = int(now * (1 + GROWTH * left / max(1, events)))
            return max(now, min(self.plan.limit, soon, int(error / VISIBLE**2)))
        return now + max(0, int(self.plan.max_gaussians) - now) // left

    @property
    def _grows(self) -> bool:
        return self.plan.max_gaussians == AUTO or self.plan.max_gaussians > self.start

    @property
    def _every(self) -> int:
        return max(1, int(self.plan.steps * GROWTH_END) // EVENTS)
