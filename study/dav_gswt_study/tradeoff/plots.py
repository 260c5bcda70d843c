"""Figures of the trade-off: all settings with their Pareto front, and a panel for each knob."""

from dav_gswt.images import figures
from dav_gswt_study.experiments import PRESET
from dav_gswt_study.figures import OKABE_ITO

AXES = {
    "views": ("seconds", "PSNR of test views (dB)"),
    "stills": ("seconds on tiles", "stills differ (grey levels)"),
    "seams": ("seconds on tiles", "Seam-LPIPS over its floor"),
}
SHOWN = {"views": "psnr", "stills": "loss", "seams": "seam_lpips"}
MARKS = "osD^vP*X"
COLUMNS, WIDE, TALL = 4, 2.9, 2.3  # inches a panel


def draw_fronts(pareto: list[dict]):
    """PSNR and, where it was measured, LPIPS over seconds of all settings that test views tell apart, the front of each
    as a line; presets have their names."""
    shown = [("psnr", "front", AXES["views"][1])]
    if any(row["sharp"] is not None for row in pareto):
        shown.append(("lpips", "sharp", "LPIPS of test views (less is better)"))
    figure = figures.make_figure(1.5 + 4.5 * len(shown), 4.6)
    panels = figure.subplots(1, len(shown), squeeze=False)[0]
    for axes, (key, on, up) in zip(panels, shown, strict=True):
        _front(axes, pareto, key, on)
        axes.set_xlabel("seconds from the start views to the bundle")
        axes.set_ylabel(up)
    figure.legend(*panels[0].get_legend_handles_labels(), loc="outside right upper", frameon=False, fontsize=8)
    return figure


def _front(axes, pareto: list[dict], key: str, on: str) -> None:
    best = sorted((row["seconds"], row[key]) for row in pareto if row[on])
    axes.plot(*zip(*best, strict=True), drawstyle="steps-post", color="0.6", linewidth=1, zorder=1) if best else None
    for n, knob in enumerate(dict.fromkeys(row["knob"] for row in pareto)):
        mine = [row for row in pareto if row["knob"] == knob]
        colour = "black" if knob == PRESET else OKABE_ITO[n % len(OKABE_ITO)]
        x, y = ([row[name] for row in mine] for name in ("seconds", key))
        axes.plot(x, y, MARKS[n % len(MARKS)], color=colour, markersize=6, label=knob, alpha=0.8, zorder=2)
        if knob == PRESET:
            _named(axes, [(row["seconds"], row[key], row["setting"]) for row in mine], 9)
    axes.margins(0.08)
    axes.set_xlim(left=0)
    axes.grid(alpha=0.3)


def _named(axes, points: list[tuple[float, float, str]], size: int) -> None:
    """Names beside points, inwards from the right end: above a point that is higher than its nearest in x, else below;
    so two that nearly meet keep their names apart."""
    xs = [x for x, _, _ in points]
    for i, (x, y, name) in enumerate(points):
        others = [(abs(x - px), py, k) for k, (px, py, _) in enumerate(points) if k != i]
        above, end = not others or (y, i) > min(others)[1:], x > min(xs) + 0.8 * (max(xs) - min(xs))
        at = {"xytext": (-5 if end else 5, 4 if above else -4), "textcoords": "offset points"}
        axes.annotate(name, (x, y), fontsize=size, va="bottom" if above else "top", ha="right" if end else "left", **at)


def draw_knobs(rows: list[dict]):
    """Quality of each knob's settings over their seconds; the base is filled."""
    names = list(dict.fromkeys(row["knob"] for row in rows))
    columns, lines = min(COLUMNS, len(names)), -(-len(names) // COLUMNS)
    figure = figures.make_figure(WIDE * columns, TALL * lines)
    grid = figure.subplots(lines, columns, squeeze=False).ravel()
    for panel, knob in zip(grid, names, strict=False):
        _panel(panel, knob, [row for row in rows if row["knob"] == knob])
    for empty in grid[len(names) :]:
        empty.axis("off")
    return figure


def _panel(panel, knob: str, rows: list[dict]) -> None:
    key, (across, up) = SHOWN[rows[0]["measure"]], AXES[rows[0]["measure"]]
    known = [row for row in rows if None not in (row["own_seconds"], row[key])]
    for row in known:
        filled = "full" if row["base"] else "none"
        panel.plot(row["own_seconds"], row[key], "o", color=OKABE_ITO[0], fillstyle=filled, markersize=6)
    _named(panel, [(row["own_seconds"], row[key], row["setting"]) for row in known], 7)
    panel.set_title(knob, fontsize=9, loc="left")
    panel.set_xlabel(across, fontsize=8)
    panel.set_ylabel(up, fontsize=8)
    panel.tick_params(labelsize=7)
    panel.margins(0.2)
    panel.grid(alpha=0.3)
