"""The page of seams: a template filled with the tables that grow in study/docs/data."""

from pathlib import Path

from dav_gswt_study.markdown import format_table, render_template
from dav_gswt_study.seams.repetition import LAGS
from dav_gswt_study.seams.summary import EVERY, MEASURES

SHOT_CAPTIONS = {  # by the names of rule render_grid
    "grid_flat": "from above",
    "grid_hilly": "the same on hills",
    "walker_flat": "a walker",
    "walker_hilly": "the same on hills",
}
DIGITS = {"seam_lpips": 4, "psnr": 2, "jump": 2}
NAMES = {"seam_lpips": "Seam-LPIPS over the floor", "psnr": "PSNR (dB)", "jump": "jump"}


def format_seam_page(
    template: Path | str, tables: tuple[list[dict], ...], own: dict[str, str], pictures: dict[str, str]
) -> str:
    """The page of seams. tables: seam_summary, seam_ablation and repetition, as `tables.read_seam_table` reads them.

    own: the tiling of each scene. pictures: captions by path.
    """
    summary, ablation, repetition = tables
    values = {
        "baseline": next((row["baseline"] for row in ablation), ""),
        "scenes": _format_scenes(summary, own),
        "variants": _format_variants(ablation),
        "repetition": _format_repetition(repetition, own),
        "pictures": pictures,
    }
    return render_template(template, values)


def _format_scenes(summary: list[dict], own: dict[str, str]) -> str:
    head = ["scene", "tiling", "sets", "borders over floor", "cuts over floor", "ceiling over floor", "share"]
    head += ["jump: border", "cut", "floor"]
    lines = []
    for row in summary:
        if (row["view"], row["ground"]) == (EVERY, EVERY) and own.get(row["scene"]) == row["variant"]:
            places = [format_interval(row, place, 4) for place in ("border", "cut", "ceiling")]
            way = f"{float(row['share']):.0%}" if row["share"] else ""
            jumps = [f"{float(row[f'{place}_jump']):.2f}" for place in ("border", "cut", "floor")]
            lines.append([row["scene"], f"`{row['variant']}`", row.get("sets") or "1", *places, way, *jumps])
    return format_table(head, lines)


def _format_variants(ablation: list[dict]) -> str:
    found = {(row["variant"], row["scene"], row["measure"]): row for row in ablation}
    cells = sorted({key[:2] for key in found}, key=lambda key: (key[0], key[1] != EVERY, key[1]))
    lines = []
    for variant, scene in cells:
        rows = [(measure, found.get((variant, scene, measure))) for measure in MEASURES]
        values = [format_interval(row, "difference", DIGITS[measure]) if row else "" for measure, row in rows]
        lines.append([f"`{variant}`", "all" if scene == EVERY else scene, *values])
    return format_table(["cut", "scene", *(NAMES[measure] for measure in MEASURES)], lines)


def _format_repetition(repetition: list[dict], own: dict[str, str]) -> str:
    lags = [(str(east), str(north)) for east, north in LAGS]
    at = {(row["scene"], row["variant"], row["east"], row["north"]): row for row in repetition}
    lines = []
    for scene, variant in own.items():
        rows = [at.get((scene, variant, *lag)) for lag in lags]
        if any(rows):
            lines.append([scene, *(_format_correlation(row) for row in rows)])
    return format_table(["scene", *(f"{east}, {north}" for east, north in lags)], lines)


def _format_correlation(row: dict | None) -> str:
    if not row or not row["terrain"]:
        return ""
    return f"{float(row['terrain']):.3f}" + (f" ({float(row['exemplar']):.3f})" if row["exemplar"] else "")


def format_interval(row: dict, name: str, digits: int) -> str:
    """A value and in brackets its interval; empty where it is not known."""
    if not row[name]:
        return ""
    value, low, high = (f"{float(row[key]):+.{digits}f}" for key in (name, f"{name}_low", f"{name}_high"))
    return f"{value} ({low}, {high})"
