"""A comparison as a table to read, for docs/research/results/view-selection.md."""

from pathlib import Path

from dav_gswt.files import atomic_file
from dav_gswt.study.comparison.tables import EVERY
from dav_gswt.study.markdown import format_table

NAMED = {  # measures, and decimals
    "psnr": ("PSNR, dB", 2),
    "worst_psnr": ("worst tenth of views, dB", 2),
    "walker_psnr": ("views at eye level, dB", 2),
    "lpips": ("LPIPS, fewer", 4),
}


def write_comparison(path: Path | str, compared: list[dict], baseline: str) -> None:
    """Write the table of `format_comparison`."""
    with atomic_file(path) as part:
        part.write_text(format_comparison(compared, baseline), encoding="utf-8")


def format_comparison(compared: list[dict], baseline: str) -> str:
    """nAUC less the baseline's: a table of PSNR with a column a scene and k, and one of all measures over all scenes.

    A row a policy, best by PSNR over all scenes first; in brackets the 95 % interval, where there is more than one
    start. LPIPS is turned over: above 0 is better everywhere.
    """
    psnr = [row for row in compared if row["measure"] == "psnr"]
    columns = sorted({(row["scene"], row["k"]) for row in psnr} - {(EVERY, "")})
    named = [f"{scene.removesuffix('_pool')}, {k} a round" for scene, k in columns]
    found = {(row["policy"], row["scene"], row["k"]): row for row in psnr}
    best = sorted((row for row in psnr if row["scene"] == EVERY), key=lambda row: -row["mean"])
    lines = []
    for row in best:
        cells = [_format_cell(found.get((row["policy"], *column))) for column in columns]
        lines.append([f"`{row['policy']}`", *cells, f"{row['wins']}, {row['ties']}, {row['losses']}"])
    by_scene = format_table(["less `" + baseline + "`, dB", *named, "wins, ties, losses"], lines)
    return by_scene + "\n" + _format_measures(compared, [row["policy"] for row in best])


def _format_measures(compared: list[dict], policies: list[str]) -> str:
    """Over all scenes: a row a policy, a column a measure."""
    found = {(row["policy"], row["measure"]): row for row in compared if row["scene"] == EVERY}
    lines = [
        [f"`{policy}`", *(_format_cell(found.get((policy, measure)), places) for measure, (_, places) in NAMED.items())]
        for policy in policies
    ]
    return format_table(["over all scenes", *(name for name, _ in NAMED.values())], lines)


def _format_cell(row: dict | None, places: int = 2) -> str:
    if row is None:
        return ""
    mean, low, high = (None if row[key] is None else f"{row[key]:+.{places}f}" for key in ("mean", "low", "high"))
    return f"{mean}" if low is None else f"{mean} ({low}, {high})"
