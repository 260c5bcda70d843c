"""When rates fall, when Gaussians grow and how many they may be, when those that show nothing go."""

from dataclasses import dataclass

from dav_gswt.reconstruction.fitting.plan import AUTO, Plan

SETTLED = 0.1  # of the rates at the start are left at the end
EVENTS = 10  # growth events of a fit
GROWN = 0.7  # of the steps: growth ends there
PRUNED = 0.8  # of the steps: then goes what shows nothing, and what stays makes up for it in those left
# Of the Gaussians there are, so many at most come at the first event of a growth without a number, a tenth of it at the
# last: what comes late is fitted little. Meadow (development, 8 photos, 600 steps): 22.28 dB, LPIPS .316 with 492k
# Gaussians of a quarter at every event, 22.46 and .297 with 419k so.
GROWTH = 0.4
VISIBLE = 0.011  # error of one pixel that is worth a Gaussian where their number is to be found, of colours 0 to 1


@dataclass(frozen=True)
class Schedule:
    """Of a fit; known before its first step.

    start: Gaussians it begins with: with as many as the cap none jumps, is added or goes, as in the fit of a level.
    """

    plan: Plan
    start: int

    def rate(self, step: int) -> float:
        """Factor of all rates: 1, falling to SETTLED."""
        return SETTLED ** (step / max(1, self.plan.steps))

    def to_growth(self, step: int) -> int | None:
        """Steps from this one to the next growth, 0: it is due now; None: none comes any more."""
        due = max(1, -(-step // self._every)) * self._every
        return due - step if self._grows and due <= GROWN * self.plan.steps else None

    def prunes(self, step: int) -> bool:
        """What shows nothing goes at this step."""
        return self._grows and step == int(PRUNED * self.plan.steps)

    def cap(self, step: int, now: int, error: float) -> int:
        """How many Gaussians there may be after growing at this step.

        error: squared error that a photo shows, summed over the Gaussians: where no number is given one Gaussian is
        worth VISIBLE**2 of it.
        """
        events = int(self.plan.steps * GROWN) // self._every
        left = max(1, events - step // self._every + 1)
        if self.plan.cap == AUTO:
            soon = int(now * (1 + GROWTH * left / max(1, events)))
            return max(now, min(self.plan.most, soon, int(error / VISIBLE**2)))
        return now + max(0, int(self.plan.cap) - now) // left

    @property
    def _grows(self) -> bool:
        return self.plan.cap == AUTO or self.plan.cap > self.start

    @property
    def _every(self) -> int:
        return max(1, int(self.plan.steps * GROWN) // EVENTS)
