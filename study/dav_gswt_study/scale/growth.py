"""The curves of all cells: a table, exponents, a figure."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from dav_gswt.images.figures import OKABE_ITO, make_figure, save_figure
from dav_gswt_study import markdown

KINDS = {  # of cells: what grows, its unit, and the cost beside the seconds
    "photos": ("photos", "photos"),
    "pixels": ("megapixels", "megapixels a photo"),
    "limits": ("gaussians", "Gaussians of the fit"),
    "gaussians": ("gaussians", "Gaussians"),
    "candidates": ("candidates", "candidates"),
    "tiles": ("tiles", "tiles in view"),
}
TITLES = {"seconds": "s", "prepare_seconds": "s before the first step", "step_seconds": "s a step", "peak_mb": "MB"}
COUNTS = {"gaussians": "Gaussians", "steps": "steps"}  # of a fit
SHORT = 60  # largest over smallest value up to which an axis has more labels than powers of ten
LAST = 3  # points that an exponent is fitted to: small cells are mostly fixed costs
COLUMNS = (
    "kind",
    "photos",
    "megapixels",
    "gaussians",
    "candidates",
    "tiles",
    "threads",
    "steps",
    "read_seconds",
    "prepare_seconds",
)
COLUMNS += ("step_seconds", "seconds", "peak_mb")


def fit_exponent(sizes: Sequence[float | int], costs: Sequence[float | int]) -> float:
    """The exponent p of cost = c size^p, by least squares of the logarithms over the LAST largest sizes."""
    order = np.argsort(sizes)[-LAST:]
    found = float(np.polyfit(np.log(np.array(sizes)[order]), np.log(np.array(costs)[order]), 1)[0])
    return round(found, 4) + 0.0  # no negative zero


def gather_rows(cells: list[dict]) -> list[dict]:
    """Rows of a table, by kind and size. cells: of `costs`, with their `kind`."""
    ordered = [
        cell
        for kind, (name, _) in (KINDS | {"threads": ("threads", "threads")}).items()
        for cell in sorted((each for each in cells if each["kind"] == kind), key=lambda each: each[name])
    ]
    return [{column: cell.get(column) for column in COLUMNS} for cell in ordered]


def fit_exponents(rows: list[dict]) -> dict[str, dict[str, float]]:
    """By kind: the exponents of seconds and of memory; of fits also those of a step."""
    found = {}
    for kind, (name, _) in KINDS.items():
        own = [row for row in rows if row["kind"] == kind]
        costs = [cost for cost in ("seconds", "prepare_seconds", "step_seconds", "peak_mb") if own and own[0][cost]]
        found[kind] = {cost: fit_exponent([row[name] for row in own], [row[cost] for row in own]) for cost in costs}
    return found


def describe_kind(rows: list[dict], kind: str) -> str:
    """The table of a kind in Markdown, with the exponents in its last row."""
    name, unit = KINDS[kind]
    own, exponents = [row for row in rows if row["kind"] == kind], fit_exponents(rows)[kind]
    counts = [count for count in COUNTS if count != name] if own[0]["steps"] else []
    head = [unit, *(COUNTS[count] for count in counts), *(TITLES[cost] for cost in exponents)]
    body = [
        [f"{row[name]:.3g}" if kind == "pixels" else f"{row[name]:.0f}", *(f"{row[count]:.0f}" for count in counts)]
        + [f"{row[cost]:.0f}" if cost == "peak_mb" else f"{row[cost]:.3g}" for cost in exponents]
        for row in own
    ]
    last = ["exponent", *[""] * len(counts), *(f"{exponent:.2f}" for exponent in exponents.values())]
    return markdown.format_table(head, [*body, last])


def find_parallel_share(rows: list[dict]) -> float:
    """Share of a fit's work on one thread that runs beside itself, by Amdahl's law from one and two threads."""
    one, two = (row["seconds"] for row in rows if row["kind"] == "threads")
    return float(np.clip(2 * (1 - two / one), 0, 1))


def describe_threads(rows: list[dict]) -> str:
    """The fits on one thread and on two, in Markdown."""
    own = [row for row in rows if row["kind"] == "threads"]
    body = [[f"{row['threads']:.0f}", f"{row['seconds']:.3g}", f"{row['step_seconds']:.3g}"] for row in own]
    return markdown.format_table(["threads", "s", "s a step"], body)


def extrapolate(rows: list[dict], size: int, cores: Sequence[int] = (2, 16, 64)) -> str:
    """Minutes of the fit with most photos, as it is and with the largest photos, on so many cores, in Markdown."""
    last = max((row for row in rows if row["kind"] == "photos"), key=lambda row: row["photos"])
    own = [row for row in rows if row["kind"] == "pixels"]
    sizes, seconds = (np.log([row[name] for row in own]) for name in ("megapixels", "seconds"))
    larger = float(np.exp(seconds[-1] - np.interp(np.log(size**2 / 1e6), sizes, seconds)))
    share, most = find_parallel_share(rows), round(1000 * own[-1]["megapixels"] ** 0.5)
    speed = {count: (1 - share / 2) / (1 - share + share / count) for count in cores}
    body = [[str(count), *(f"{last['seconds'] * by / speed[count] / 60:.0f}" for by in (1, larger))] for count in cores]
    return markdown.format_table(["cores", f"minutes at {size} pixels", f"minutes at {most} pixels"], body)


def plot_growth(rows: list[dict], path: Path | str) -> None:
    """Seconds and memory over each size, on logarithmic axes, with lines of exponent 1."""
    figure = make_figure(16.0, 5.2)
    axes = figure.subplots(2, len(KINDS), squeeze=False)
    for column, (kind, (name, unit)) in enumerate(KINDS.items()):
        own = [row for row in rows if row["kind"] == kind]
        for row, (cost, label) in enumerate((("seconds", "seconds"), ("peak_mb", "megabytes"))):
            x, y = np.array([[each[name], each[cost]] for each in own], float).T
            axis = axes[row, column]
            axis.loglog(x, y, "o-", color=OKABE_ITO[row], label="measured")
            axis.loglog(x, y[-1] * x / x[-1], ":", color="0.5", label="exponent 1")
            axis.set_xlabel(unit)
            axis.set_ylabel(label)
            axis.grid(True, which="both", alpha=0.2)
            _label_plainly(axis.xaxis)
            _label_plainly(axis.yaxis)
    axes[0, 0].legend()
    save_figure(figure, path)


def _label_plainly(axis) -> None:
    """Label powers of ten as 10k; on a short axis 2 and 5 times them, too. Minor ticks have no label."""
    from matplotlib.ticker import EngFormatter, LogLocator, NullFormatter  # here, not above: see `figures.make_figure`

    low, high = axis.get_view_interval()
    axis.set_major_locator(LogLocator(subs=(1, 2, 5) if high < SHORT * low else (1,)))
    axis.set_major_formatter(EngFormatter(sep="") if low >= 1 else "{x:g}")
    axis.set_minor_formatter(NullFormatter())
