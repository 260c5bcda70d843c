"""Parts of figures that several experiments draw."""

from collections.abc import Sequence

import numpy as np

from dav_gswt_study.figures import OKABE_ITO

Estimate = tuple[float | None, ...]  # a mean and the ends of its interval, None where unknown


def draw_forest(
    axes, names: Sequence[str], estimates: Sequence[Estimate], dots: Sequence[Sequence[float]], middle: float = 0.0
) -> None:
    """A line a name, from the top: a mean as a square, its interval, and single values as dots. middle: marked."""
    for place, ((mean, low, high), single) in enumerate(zip(estimates, dots, strict=True)):
        if low is not None:
            axes.plot([low, high], [place, place], color="0.25", linewidth=2)
        if mean is not None:
            axes.plot(mean, place, "s", color="0.25", markersize=6)
        axes.plot(single, [place] * len(single), "o", color=OKABE_ITO[0], markersize=4, alpha=0.7)
    axes.axvline(middle, color="black", linewidth=1, linestyle=":")
    axes.set_yticks(range(len(names)), names, fontsize=9)
    axes.set_ylim(len(names) - 0.5, -0.5)
    axes.tick_params(axis="x", labelsize=8)
    axes.grid(axis="x", alpha=0.3)


def draw_curve(axes, rows: Sequence[dict], label: str, **look) -> None:
    """PSNR against photos, means over the rows with as many photos."""
    known = [row for row in rows if row["psnr"] is not None]
    photos = sorted({row["photos"] for row in known})
    means = [float(np.mean([row["psnr"] for row in known if row["photos"] == n])) for n in photos]
    axes.plot(photos, means, marker="o", markersize=3.5, label=label, **look)


def draw_everything(axes, rows: Sequence[dict]) -> None:
    """A dotted line at the mean PSNR of fits of all photos: what there is to reach."""
    if rows:
        mean = float(np.mean([row["psnr"] for row in rows]))
        axes.axhline(mean, color="0.6", linewidth=1.2, linestyle=":", label="all photos")


def label_curves(axes) -> None:
    """Labels and grid of PSNR against photos."""
    axes.set_xlabel("photos", fontsize=9)
    axes.set_ylabel("PSNR of test views (dB)", fontsize=9)
    axes.tick_params(labelsize=8)
    axes.grid(alpha=0.3)
