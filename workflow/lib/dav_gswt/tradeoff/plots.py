"""Figures of the trade-off: all settings with their front, and a panel a knob."""

from dav_gswt import figures
from dav_gswt.active.comparison.plots import COLOURS
from dav_gswt.tradeoff.settings import PRESET

AXES = {
    "views": ("seconds", "PSNR of test views (dB)"),
    "stills": ("seconds on tiles", "stills differ (grey levels)"),
    "seams": ("seconds on tiles", "Seam-LPIPS over its floor"),
}
SHOWN = {"views": "psnr", "stills": "loss", "seams": "seam_lpips"}
MARKS = "osD^vP*X"
COLUMNS, WIDE, TALL = 4, 2.9, 2.3  # inches a panel


def fronts(pareto: list[dict]):
    """PSNR over seconds of all settings that test views tell apart, their front as a line; presets have their names."""
    figure = figures.blank(7.5, 4.6)
    axes = figure.add_subplot()
    on = sorted((row["seconds"], row["psnr"]) for row in pareto if row["front"])
    axes.plot(*zip(*on, strict=True), drawstyle="steps-post", color="0.6", linewidth=1, zorder=1) if on else None
    for n, knob in enumerate(dict.fromkeys(row["knob"] for row in pareto)):
        mine = [row for row in pareto if row["knob"] == knob]
        colour = "black" if knob == PRESET else COLOURS[n % len(COLOURS)]
        x, y = ([row[key] for row in mine] for key in ("seconds", "psnr"))
        axes.plot(x, y, MARKS[n % len(MARKS)], color=colour, markersize=6, label=knob, alpha=0.8, zorder=2)
        for row in mine if knob == PRESET else []:
            at = {"xytext": (6, 4), "textcoords": "offset points"}
            axes.annotate(row["setting"], (row["seconds"], row["psnr"]), fontsize=9, **at)
    axes.set_xlabel("seconds from the start views to the bundle")
    axes.set_ylabel(AXES["views"][1])
    axes.margins(0.08)
    axes.set_xlim(left=0)
    axes.grid(alpha=0.3)
    figure.legend(loc="outside right upper", frameon=False, fontsize=8)
    return figure


def knobs(rows: list[dict]):
    """What a knob's settings are worth over their seconds; the base is filled."""
    names = list(dict.fromkeys(row["knob"] for row in rows))
    columns, lines = min(COLUMNS, len(names)), -(-len(names) // COLUMNS)
    figure = figures.blank(WIDE * columns, TALL * lines)
    grid = figure.subplots(lines, columns, squeeze=False).ravel()
    for panel, knob in zip(grid, names, strict=False):
        _panel(panel, knob, [row for row in rows if row["knob"] == knob])
    for empty in grid[len(names) :]:
        empty.axis("off")
    return figure


def _panel(panel, knob: str, rows: list[dict]) -> None:
    key, (across, up) = SHOWN[rows[0]["measure"]], AXES[rows[0]["measure"]]
    for row in rows:
        if None in (row["own_seconds"], row[key]):
            continue
        point = (row["own_seconds"], row[key])
        panel.plot(*point, "o", color=COLOURS[0], fillstyle="full" if row["base"] else "none", markersize=6)
        panel.annotate(row["setting"], point, xytext=(4, 4), textcoords="offset points", fontsize=7)
    panel.set_title(knob, fontsize=9, loc="left")
    panel.set_xlabel(across, fontsize=8)
    panel.set_ylabel(up, fontsize=8)
    panel.tick_params(labelsize=7)
    panel.margins(0.2)
    panel.grid(alpha=0.3)
