"""The curves of all cells: a table, exponents, a figure."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from dav_gswt.images.figures import OKABE_ITO, make_figure, save_figure
from dav_gswt.study import markdown

KINDS = {  # of cells: what grows, its unit, and the cost beside the seconds
    "photos": ("photos", "photos"),
    "pixels": ("megapixels", "megapixels a photo"),
    "gaussians": ("gaussians", "Gaussians"),
    "candidates": ("candidates", "candidates"),
}
LAST = 3  # points that an exponent is fitted to: small cells are mostly fixed costs
COLUMNS = ("kind", "photos", "megapixels", "gaussians", "candidates", "steps", "read_seconds", "prepare_seconds")
COLUMNS += ("step_seconds", "seconds", "peak_mb")


def fit_exponent(sizes: Sequence[float | int], costs: Sequence[float | int]) -> float:
    """The exponent p of cost = c size^p, by least squares of the logarithms over the LAST largest sizes."""
    order = np.argsort(sizes)[-LAST:]
    return float(np.polyfit(np.log(np.array(sizes)[order]), np.log(np.array(costs)[order]), 1)[0])


def gather_rows(cells: list[dict]) -> list[dict]:
    """Rows of a table, by kind and size. cells: of `costs`, with their `kind`."""
    ordered = [
        cell
        for kind, (name, _) in KINDS.items()
        for cell in sorted((each for each in cells if each["kind"] == kind), key=lambda each: each[name])
    ]
    return [{column: cell.get(column) for column in COLUMNS} for cell in ordered]


def fit_exponents(rows: list[dict]) -> dict[str, dict[str, float]]:
    """By kind: the exponents of seconds and of memory; of photos and pixels also those of a step."""
    found = {}
    for kind, (name, _) in KINDS.items():
        own = [row for row in rows if row["kind"] == kind]
        costs = [cost for cost in ("seconds", "prepare_seconds", "step_seconds", "peak_mb") if own and own[0][cost]]
        found[kind] = {cost: fit_exponent([row[name] for row in own], [row[cost] for row in own]) for cost in costs}
    return found


def describe_growth(rows: list[dict]) -> str:
    """The table in Markdown, and the exponents below it."""
    parts = []
    for kind, (name, unit) in KINDS.items():
        own, exponents = [row for row in rows if row["kind"] == kind], fit_exponents(rows)[kind]
        costs = list(exponents)
        head = [unit, *(["Gaussians", "steps"] if own[0]["steps"] else []), *(_title(cost) for cost in costs)]
        body = [
            [
                f"{row[name]:g}",
                *([row["gaussians"], row["steps"]] if row["steps"] else []),
                *(f"{row[cost]:.3g}" if cost != "peak_mb" else f"{row[cost]:.0f}" for cost in costs),
            ]
            for row in own
        ]
        last = ["exponent", *([""] * (len(head) - len(costs) - 1)), *(f"{exponents[cost]:.2f}" for cost in costs)]
        parts.append(markdown.format_table(head, [*body, last]))
    return "\n".join(parts)


def _title(cost: str) -> str:
    titles = {"seconds": "s", "prepare_seconds": "s before the first step", "step_seconds": "s a step", "peak_mb": "MB"}
    return titles[cost]


def plot_growth(rows: list[dict], path: Path | str) -> None:
    """Seconds and memory over each size, on logarithmic axes, with lines of exponent 1."""
    figure = make_figure(11.0, 5.2)
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
    axes[0, 0].legend()
    save_figure(figure, path)
