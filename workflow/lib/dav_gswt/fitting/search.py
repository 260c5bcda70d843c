"""As much as the scene requires: when to stop growing, enriching and stepping.

While "searching", rates stay high; every window of steps is judged by the held-out pixels. What brings less than GAIN
a window stops: first growth, then (where asked for) the spherical harmonics, whose next degree is tried for a window
and taken back if it does not pay. Then rates fall and the fit settles.
"""

from dataclasses import dataclass

from dav_gswt.fitting.held_out import GAIN, WINDOW
from dav_gswt.fitting.plan import AUTO, MOST_DEGREE, MOST_GAUSSIANS, Plan, Report

SETTLING = 0.5  # of the steps so far are taken once more with falling rates
LEAST_SETTLING = 100
GROWTH = 0.15  # of the Gaussians there are, at each event of a growth without a number
EVENTS = 10  # growth events of a fit with a number of steps
GROWN = 0.7  # of the steps: growth ends there


@dataclass
class Search:
    """Where a fit stands between its first step and its last. All plain numbers: it goes into snapshots."""

    plan: Plan
    window: int  # steps from one look at the held-out pixels to the next
    start: int  # Gaussians before the first step
    last: float | None = None  # PSNR at the last look
    trend: float = 0.0  # what the last window gained
    growing: bool = True
    trying: int | None = None  # degree on trial
    settled_from: int | None = None  # the step from which rates fall
    end: int | None = None  # the last step, once known

    @classmethod
    def of(cls, plan: Plan, views: int, start: int) -> "Search":
        """At the beginning; a window is a whole number of turns through the views."""
        search = cls(plan, max(1, -(-WINDOW // views)) * views, start)
        if plan.steps != AUTO:
            search.settled_from, search.end = 0, int(plan.steps)
        search.growing = plan.cap == AUTO or plan.cap > start
        return search

    def rate(self, step: int) -> float:
        """Factor of all rates: 1, falling to a tenth while the fit settles."""
        if self.settled_from is None:
            return 1.0
        return 0.1 ** ((step - self.settled_from) / max(1, self.end - self.settled_from))

    def done(self, step: int) -> bool:
        """No step is left."""
        return step >= (self.plan.most_steps if self.end is None else self.end)

    def cap(self, step: int, now: int) -> int | None:
        """How many Gaussians there may be after growing at this step; None: this step does not grow."""
        if not self.growing:
            return None
        most = MOST_GAUSSIANS if self.plan.cap == AUTO else int(self.plan.cap)
        if self.plan.steps == AUTO:
            return min(most, int(now * (1 + GROWTH))) if step and step % self.window == 0 else None
        every = max(1, int(self.plan.steps * GROWN) // EVENTS)
        if step == 0 or step % every or step > GROWN * self.plan.steps:
            return None
        if self.plan.cap == AUTO:
            return min(most, int(now * (1 + GROWTH)))
        left = max(1, EVENTS - step // every + 1)
        return now + max(0, most - now) // left

    def look(self, step: int, psnr: float, now: int, degree: int, report: Report) -> str | None:
        """Judge the window that ends with this step. Returns what is to be done: "enrich", "take back" or nothing."""
        gain = float("inf") if self.last is None else psnr - self.last
        trend, self.trend, self.last = self.trend, gain, psnr
        report.held_out.append({"step": step, "psnr": round(psnr, 3), "gaussians": now})
        why = f"{gain:+.3f} dB on held-out pixels in {self.window} steps"
        if self.trying is not None:
            return self._judge_trial(gain - max(0.0, trend), degree, step, why, report)
        if gain >= GAIN or self.settled_from not in (None, 0):
            return self._bound(step, report)
        if self.growing and self.plan.cap == AUTO:
            self.growing = False
            report.chose("cap", now, why)
            return None
        if self.plan.degree == AUTO and self._room(degree, step) and not self._decided("degree", report):
            self.trying = degree + 1
            return "enrich"
        if self.plan.steps == AUTO and self.settled_from is None:
            self._settle(step, why, report)
        return None

    def _judge_trial(self, gain: float, degree: int, step: int, why: str, report: Report) -> str | None:
        paid = gain >= GAIN
        self.trying = degree + 1 if paid and self._room(degree, step) else None
        if self.trying is None:
            report.chose("degree", degree if paid else degree - 1, why)
        return ("enrich" if self.trying else None) if paid else "take back"

    def _room(self, degree: int, step: int) -> bool:
        """There is a next degree, and time to judge it and to settle."""
        most = self.plan.most_steps if self.plan.steps == AUTO else self.end
        return degree < MOST_DEGREE and step + 2 * self.window <= most

    def _bound(self, step: int, report: Report) -> None:
        if self.settled_from is None and step >= self.plan.most_steps * (1 - SETTLING):
            self._settle(step, f"the most steps there are ({self.plan.most_steps})", report)

    def _settle(self, step: int, why: str, report: Report) -> None:
        self.settled_from = step
        self.end = min(step + max(LEAST_SETTLING, int(SETTLING * step)), max(step, self.plan.most_steps))
        self.growing = False
        report.chose("steps", self.end, why)

    @staticmethod
    def _decided(what: str, report: Report) -> bool:
        return any(choice["what"] == what for choice in report.choices)
