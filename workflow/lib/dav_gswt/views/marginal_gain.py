"""What the next photos are worth: expected from what the captured photos themselves told, no test photo is asked.

A field shows the photos that it was fitted to better than any other: by a gap that is the wider, the fewer they are.
Each new photo, before it is fitted to, tells how wide. New photos narrow it, and views that nobody took gain about half
of what it loses.
"""

from dataclasses import dataclass

import numpy as np
from scipy.special import ndtri, stdtrit  # scipy.stats has them too, but loads for longer than most jobs take

LEVEL = 0.95  # of the interval
LEAST = 3  # new photos, without which nothing can be said
# Of the gap that closes, what test views gained, and the standard deviation of its logarithm from cell to cell: over 27
# rounds on development scenes (desert, grass, flowers, caliterra_earthworks; draft, `farthest`, four photos a round).
# How they do on others: docs/research/data/view_worth.csv.
SHARE, OFF = 0.5, 0.4
SCENES = 4  # that these two are from: few, so another scene may be farther off than a normal law says


@dataclass(frozen=True)
class RoundGaps:
    """fitted: photos that the field was fitted to before this round. gaps: dB by which it shows each photo of the round
    worse than those, on average."""

    fitted: int
    gaps: list[float]


@dataclass(frozen=True)
class FitHistory:
    """fitted: photos that the field is fitted to now. coming: how many the next round would take."""

    rounds: list[RoundGaps]
    fitted: int
    coming: int


@dataclass(frozen=True)
class ExpectedGain:
    """What the next `photos` photos are expected to gain in all, in dB, and the ends of the 95 % interval. closes: how
    much of the gap they close, in dB: `gain` is a share of it."""

    photos: int
    gain: float
    low: float
    high: float
    closes: float

    @property
    def each(self) -> float:
        """dB per photo."""
        return self.gain / self.photos


def predict_gain(history: FitHistory) -> ExpectedGain | None:
    """The gain that a field fitted to n photos has to expect of k more.

    Model: the gap is c / n, c its mean over all new photos so far; k photos close c (1 / n - 1 / (n + k)) of it, and
    other views gain SHARE of that. The interval is of the logarithm: normal of c, from photo to photo, and of SHARE
    Student's t for one scene more than SCENES, t_(SCENES - 1) OFF sqrt(1 + 1 / SCENES). Where new photos are shown no
    worse than old ones the gain is 0, and may be what c's own interval allows.
    Returns: None where nothing can be said: fewer than LEAST new photos so far, or none to come.
    """
    found = np.array([r.fitted * gap for r in history.rounds for gap in r.gaps])
    if len(found) < LEAST or history.coming < 1:
        return None
    n, k, reach = history.fitted, history.coming, float(ndtri((1 + LEVEL) / 2))
    part = 1 / n - 1 / (n + k)
    c, error = float(found.mean()), float(found.std(ddof=1) / np.sqrt(len(found)))
    if not c > 0:
        return ExpectedGain(k, 0.0, 0.0, SHARE * part * max(0.0, c + reach * error), 0.0)
    scene = float(stdtrit(SCENES - 1, (1 + LEVEL) / 2)) * OFF * np.sqrt(1 + 1 / SCENES)
    gain, wide = SHARE * part * c, float(np.exp(np.hypot(scene, reach * error / c)))
    return ExpectedGain(k, gain, gain / wide, gain * wide, part * c)


def build_history(reports: list[dict], start: int, coming: int) -> FitHistory:
    """What the reports of the rounds so far (fit.json) tell. start: photos before the first round.

    Photos that were set aside because they contradict the others tell nothing: the field was never fitted to them.
    """
    rounds, fitted = [], start
    for report in reports:
        new, earlier = report["new_views"], report["earlier_views"]
        if new["taken"] and new["photos"]:
            level = earlier["psnr_before"]
            unseen = [row["psnr_before"] for row in new["views"] if row["psnr_before"] is not None]
            rounds.append(RoundGaps(fitted, [] if level is None else [level - value for value in unseen]))
            fitted += new["photos"]
    return FitHistory(rounds, fitted, coming)
