"""The page about view selection: policies compared over groups of scenes, scene by scene, and with all photos.

Its figure has PSNR against photos, scene by scene, and below how far each policy is from the baseline.
"""

from pathlib import Path

from dav_gswt.images import figures
from dav_gswt_study import plots
from dav_gswt_study.comparison.tables import EVERY, EVERYTHING
from dav_gswt_study.figures import OKABE_ITO
from dav_gswt_study.markdown import format_number, format_table

NAMED = {  # measures, and decimals
    "psnr": ("gain in PSNR (dB)", 2),
    "worst_psnr": ("gain in PSNR of the worst tenth of the views (dB)", 2),
    "walker_psnr": ("gain in PSNR at eye level (dB)", 2),
    "lpips": ("decrease of LPIPS", 4),
}
ALL_SCENES = "all scenes"
PANEL = 3.3, 3.4  # inches
FOREST = 0.34  # inches a policy
SHOWN = 6  # curves that a panel holds legibly: the baseline and the best
BASE = {"color": "black", "linewidth": 2.4}


def describe_comparison(
    curves: list[dict], results: list[dict], compared: list[dict], grouped: list[dict], baseline: str
) -> dict:
    """Values of the page's template.

    curves, results, compared, grouped: rows of `read_curves`, `summarise_cells`, `compare_to_baseline` and
    `compare_groups`.
    """
    overall = [row | {"group": ALL_SCENES} for row in compared if row["scene"] == EVERY]
    return {
        "baseline": baseline,
        "version": curves[0]["version"],
        "renderer": curves[0]["renderer"],
        "groups": format_groups(grouped + overall),
        "scenes": format_scenes(compared),
        "ends": format_ends(results),
    }


def format_groups(rows: list[dict]) -> str:
    """nAUC less the baseline's, a row a group and policy, a column a measure.

    In brackets the 95 % interval, where there is more than one cell. LPIPS is turned over: above 0 is always better.
    """
    found = {(row["group"], row["policy"], row["measure"]): row for row in rows}
    lines = []
    for group, policy in dict.fromkeys((row["group"], row["policy"]) for row in rows):
        psnr = found[group, policy, "psnr"]
        cells = [_format_cell(found.get((group, policy, measure)), places) for measure, (_, places) in NAMED.items()]
        lines.append([group, f"`{policy}`", psnr["units"], *cells, f"{psnr['wins']}, {psnr['ties']}, {psnr['losses']}"])
    heads = ["", "policy", "pairs", *(name for name, _ in NAMED.values()), "wins, ties, losses (PSNR)"]
    return format_table(heads, lines)


def format_scenes(compared: list[dict]) -> str:
    """PSNR less the baseline's, a row a scene and k, a column a policy, the best over all scenes first."""
    psnr = [row for row in compared if row["measure"] == "psnr"]
    best = _rank_policies(psnr)
    found = {(row["policy"], row["scene"], row["k"]): row for row in psnr}
    places = sorted({(row["scene"], row["k"]) for row in psnr} - {(EVERY, "")})
    lines = [
        [f"{scene}, {k} photos at a time", *(_format_cell(found.get((row["policy"], scene, k))) for row in best)]
        for scene, k in places
    ]
    return format_table(["scene", *(f"`{row['policy']}`" for row in best)], lines)


def format_ends(results: list[dict]) -> str:
    """Where each policy ends, means over starts: PSNR, LPIPS, dB under all photos where these were fitted."""
    lines = []
    for scene, policy, k in dict.fromkeys((row["scene"], row["policy"], row["k"]) for row in results):
        mine = [row for row in results if (row["scene"], row["policy"], row["k"]) == (scene, policy, k)]
        means = [
            _average(mine, key, digits) for key, digits in (("psnr", 2), ("walker_psnr", 2), ("lpips", 3), ("gap", 2))
        ]
        lines.append([scene, f"`{policy}`", len(mine), mine[0]["photos"], *means])
    heads = ["scene", "policy", "sets of start photos", "photos", "PSNR (dB)", "PSNR at eye level (dB)", "LPIPS"]
    heads.append("PSNR of the fit to all photos, minus PSNR (dB)")
    return format_table(heads, lines)


def _average(rows: list[dict], key: str, digits: int) -> str:
    values = [row[key] for row in rows if row[key] is not None]
    return format_number(sum(values) / len(values), digits) if values else ""


def _format_cell(row: dict | None, places: int = 2) -> str:
    if row is None:
        return ""
    mean, low, high = (None if row[key] is None else f"{row[key]:+.{places}f}" for key in ("mean", "low", "high"))
    return f"{mean}" if low is None else f"{mean} ({low}, {high})"


def write_figure(path: Path | str, curves: list[dict], compared: list[dict], baseline: str) -> None:
    """Above a panel a scene (and k): PSNR against photos, means over seeds; below every policy less the baseline."""
    compared = [row for row in compared if row["measure"] == "psnr"]
    panels = sorted({(row["scene"], row["k"]) for row in curves if row["policy"] == baseline})
    policies = [row["policy"] for row in _rank_policies(compared)]
    best = policies[: SHOWN - 1]
    looks = {baseline: BASE} | {
        policy: {"color": colour, "linewidth": 1.6} for policy, colour in zip(best, OKABE_ITO, strict=False)
    }
    columns = min(3, len(panels))
    above = -(-len(panels) // columns)
    heights = [PANEL[1] * above, FOREST * len(policies) + 1.3]
    figure = figures.make_figure(PANEL[0] * 3, PANEL[1] * above + FOREST * len(policies) + 1.3)
    top, bottom = figure.subfigures(2, 1, squeeze=False, height_ratios=heights).ravel()
    grid = top.subplots(above, columns, squeeze=False).ravel()
    for axes, (scene, k) in zip(grid, panels, strict=False):
        _draw_curves(axes, [row for row in curves if row["scene"] == scene], k, looks)
        axes.set_title(f"{scene}, {k} a round", fontsize=10, loc="left")
    for empty in grid[len(panels) :]:
        empty.axis("off")
    shown = {label: line for axes in grid for line, label in zip(*axes.get_legend_handles_labels(), strict=True)}
    top.legend(list(shown.values()), list(shown), loc="outside lower center", ncols=4, frameon=False, fontsize=9)
    _draw_forest(bottom.subplots(), compared, baseline)
    figures.save_figure(figure, path)


def _draw_curves(axes, rows: list[dict], k: int, looks: dict[str, dict]) -> None:
    for policy, look in looks.items():
        plots.draw_curve(axes, [row for row in rows if row["policy"] == policy and row["k"] == k], policy, **look)
    plots.draw_everything(axes, [row for row in rows if row["policy"] == EVERYTHING and row["round"] == 1])
    plots.label_curves(axes)
    axes.xaxis.get_major_locator().set_params(integer=True)


def _rank_policies(compared: list[dict]) -> list[dict]:
    return sorted((row for row in compared if row["scene"] == EVERY), key=lambda row: -row["mean"])


def _draw_forest(axes, compared: list[dict], baseline: str) -> None:
    """A bar a policy, its 95 % interval over all scenes, and a dot a scene."""
    ranked = _rank_policies(compared)
    alone = [[r["mean"] for r in compared if r["policy"] == row["policy"] and r["scene"] != EVERY] for row in ranked]
    names, found = [row["policy"] for row in ranked], [(row["mean"], row["low"], row["high"]) for row in ranked]
    plots.draw_forest(axes, names, found, alone)
    axes.set_xlabel(f"nAUC minus {baseline} (dB): mean and 95 % interval over scenes, one dot per scene", fontsize=9)
