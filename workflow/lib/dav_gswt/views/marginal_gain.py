"""Expected gain of the next photos, from captured photos only; no test photo is used.

A field shows the photos that it was fitted to better than others. This gap shrinks with their number, and each new
photo measures it before the field is fitted to it. Test views gain about half of what the gap loses.
"""

from dataclasses import dataclass

import numpy as np
from scipy.special import ndtri, stdtrit  # scipy.stats has them too, but loads for longer than most jobs take

LEVEL = 0.95  # of the interval
LEAST = 3  # new photos needed for an estimate
SHARE = 0.5  # of the closed gap that test views gain, measured on development scenes
SPREAD = 0.4  # standard deviation of the logarithm of SHARE between experiments
SCENES = 4  # behind both constants; the interval uses Student's t for so few


@dataclass(frozen=True)
class RoundGaps:
    """fitted: photos before this round. gaps: dB by which each photo of the round is shown worse than those on
    average."""

    fitted: int
    gaps: list[float]


@dataclass(frozen=True)
class FitHistory:
    """fitted: photos so far. coming: photos of the next round."""

    rounds: list[RoundGaps]
    fitted: int
    coming: int


@dataclass(frozen=True)
class ExpectedGain:
    """Expected gain of the next `photos` photos together in dB, and the ends of its 95 % interval. closes: dB of the
    gap that they close; `gain` is a share of it."""

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
    """Predict the gain of a field fitted to n photos from k more.

    Model: the gap is c / n, with c estimated from all new photos so far; k photos close c (1 / n - 1 / (n + k)) of it,
    and test views gain SHARE of that. The interval is of the logarithm: normal for c, Student's t for SHARE on one more
    scene, t_(SCENES - 1) SPREAD sqrt(1 + 1 / SCENES). If c <= 0 the gain is 0, and its upper end follows from c alone.
    Returns: None with fewer than LEAST new photos so far, or none to come.
    """
    gaps = np.array([r.fitted * gap for r in history.rounds for gap in r.gaps])
    if len(gaps) < LEAST or history.coming < 1:
        return None
    n, k, z = history.fitted, history.coming, float(ndtri((1 + LEVEL) / 2))
    part = 1 / n - 1 / (n + k)
    c, error = float(gaps.mean()), float(gaps.std(ddof=1) / np.sqrt(len(gaps)))
    if not c > 0:
        return ExpectedGain(k, 0.0, 0.0, SHARE * part * max(0.0, c + z * error), 0.0)
    scene = float(stdtrit(SCENES - 1, (1 + LEVEL) / 2)) * SPREAD * np.sqrt(1 + 1 / SCENES)
    gain, wide = SHARE * part * c, float(np.exp(np.hypot(scene, z * error / c)))
    return ExpectedGain(k, gain, gain / wide, gain * wide, part * c)


def build_history(reports: list[dict], start: int, coming: int) -> FitHistory:
    """Collect the gaps from the reports of the rounds so far (fit.json). start: photos before the first round.

    Rejected photos are left out: the field was never fitted to them.
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
