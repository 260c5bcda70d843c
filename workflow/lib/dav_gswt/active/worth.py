"""What the next photos are worth: expected from what the captured photos themselves told, no test photo is asked.

Each new photo is compared with the field before it is fitted to: until then the field has not seen it, and shows it as
badly as any that is taken where the policy looks.
"""

from dataclasses import dataclass

import numpy as np
from scipy.stats import t as student

LEVEL = 0.95  # of the interval
LEAST = 3  # photos, of at least two rounds, without which nothing can be said


@dataclass(frozen=True)
class Round:
    """fitted: photos that the field was fitted to before this round. unseen: PSNR in dB of each of the round's photos
    under that field."""

    fitted: int
    unseen: list[float]


@dataclass(frozen=True)
class History:
    """fitted: photos that the field is fitted to now. coming: how many the next round would take."""

    rounds: list[Round]
    fitted: int
    coming: int


@dataclass(frozen=True)
class Worth:
    """What the next `photos` photos are expected to gain in all, in dB, and the ends of the 95 % interval."""

    photos: int
    gain: float
    low: float
    high: float

    @property
    def each(self) -> float:
        """dB per photo."""
        return self.gain / self.photos


def expected(history: History) -> Worth | None:
    """The gain that a field fitted to n photos has to expect of k more, by how unseen photos were shown so far.

    Model: a photo adds c / n, so a photo that was not seen is shown with a + c ln n dB; c by least squares over the
    photos of all rounds, and the gain is c ln((n + k) / n). The interval is Student's, of the slope c alone: it says
    nothing of whether the policy goes to ever harder places, nor of a model that is wrong.
    Returns: None where nothing can be said: rounds of fewer than two sizes, fewer than three photos, none to come.
    """
    n = np.array([r.fitted for r in history.rounds for _ in r.unseen], float)
    psnr = np.array([value for r in history.rounds for value in r.unseen], float)
    if len(psnr) < LEAST or len(np.unique(n)) < 2 or history.coming < 1:
        return None
    x = np.log(n) - np.log(n).mean()
    slope = float(x @ psnr / (x @ x))
    left = psnr - psnr.mean() - slope * x
    free = len(psnr) - 2
    either = float(student.ppf((1 + LEVEL) / 2, free) * np.sqrt(left @ left / free / (x @ x)))
    factor = float(np.log1p(history.coming / history.fitted))
    return Worth(history.coming, factor * slope, factor * (slope - either), factor * (slope + either))


def history(reports: list[dict], start: int, coming: int) -> History:
    """What the reports of the rounds so far (fit.json) tell. start: photos before the first round.

    Photos that were set aside because they contradict the others tell nothing: the field was never fitted to them.
    """
    rounds, fitted = [], start
    for report in (report["new_views"] for report in reports):
        if report["taken"]:
            unseen = [row["psnr_before"] for row in report["views"] if row["psnr_before"] is not None]
            rounds.append(Round(fitted, unseen))
            fitted += report["photos"]
    return History(rounds, fitted, coming)
