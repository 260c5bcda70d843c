"""The page docs/research/results/seams.md. Every number comes from the tables that add up in docs/research/data."""

from pathlib import Path

from dav_gswt.files import atomic_file
from dav_gswt.study.markdown import format_table
from dav_gswt.study.seams.repetition import LAGS
from dav_gswt.study.seams.summary import EVERY, MEASURES

SHOTS = {  # as rule draw_grid calls them
    "grid_flat": "20 x 20 tiles from above",
    "grid_hilly": "the same on hills",
    "walker_flat": "a walker",
    "walker_hilly": "the same on hills",
}
DIGITS = {"seam_lpips": 4, "psnr": 2, "jump": 2}
NAMES = {"seam_lpips": "Seam-LPIPS over the floor", "psnr": "PSNR (dB)", "jump": "jump"}
MEANT = """
Crops of 48 pixels are taken on the **borders** between tiles, where there are such places without a cut beside them,
and on the **cuts** inside tiles: on level ground and on hills, from near, as a walker sees them and from above.
Seam-LPIPS is a crop's distance from the crops of the exemplar most like it. Its **floor** is that of the patches that
meet there, each laid whole: what the same ground has without a seam; the **ceiling** is that of the same patches cut
straight without looking. A **jump** is the colour difference of neighbouring pixels across a seam over that beside it;
1 is none. Brackets hold the 95 % interval, over places of strips and tiles, since every place is laid many times. Sets:
how many tile sets were cut, each from places drawn anew. Way: how far from floor to ceiling cuts are, where the ceiling
surely lies above the floor.
"""


def write(path: Path | str, told: str) -> None:
    """The page's text as a file."""
    with atomic_file(path) as part:
        part.write_text(told, encoding="utf-8")


def text(summary: list[dict], ablation: list[dict], repetition: list[dict], own: dict[str, str], pictures: dict) -> str:
    """Rows of the tables as `tables.read` gives them. own: each scene's own seam. pictures: captions by path."""
    baseline = next((row["baseline"] for row in ablation), "")
    parts = [
        "# Can anybody find the seams?\nThis page is made by `snakemake seams`, from "
        "`docs/research/data/seam_summary.csv`, `seam_ablation.csv` and `repetition.csv`; do not edit it.",
        MEANT.strip(),
        "## Every scene as its own seam says",
        _scenes(summary, own),
        f"## Ways to cut, less `{baseline}`",
        "Of cuts in tiles of one size, over all scenes and scene by scene. Higher is better for PSNR, lower for the "
        "others.",
        _ways(ablation),
        "## What repeats",
        "Autocorrelation of the terrain from above, so many tiles to the east and the north; in brackets that of the "
        "exemplar, where it is as large. A lattice that the eye finds is a high one.",
        _repeats(repetition, own),
        "## To be looked at",
        *(f"![{caption}]({path})" for path, caption in pictures.items()),
    ]
    return "\n\n".join(part.rstrip("\n") for part in parts) + "\n"


def _scenes(summary: list[dict], own: dict[str, str]) -> str:
    head = [
        "scene",
        "seam",
        "sets",
        "borders over floor",
        "cuts over floor",
        "ceiling over floor",
        "way",
        "jump: border",
        "cut",
        "floor",
    ]
    lines = []
    for row in summary:
        if (row["view"], row["ground"]) == (EVERY, EVERY) and own.get(row["scene"]) == row["variant"]:
            places = [between(row, place, 4) for place in ("border", "cut", "ceiling")]
            way = f"{float(row['share']):.0%}" if row["share"] else ""
            jumps = [f"{float(row[f'{place}_jump']):.2f}" for place in ("border", "cut", "floor")]
            lines.append([row["scene"], f"`{row['variant']}`", row.get("sets") or "1", *places, way, *jumps])
    return format_table(head, lines)


def _ways(ablation: list[dict]) -> str:
    found = {(row["variant"], row["scene"], row["measure"]): row for row in ablation}
    cells = sorted({key[:2] for key in found}, key=lambda key: (key[0], key[1] != EVERY, key[1]))
    lines = []
    for variant, scene in cells:
        rows = [(measure, found.get((variant, scene, measure))) for measure in MEASURES]
        values = [between(row, "difference", DIGITS[measure]) if row else "" for measure, row in rows]
        lines.append([f"`{variant}`", "all" if scene == EVERY else scene, *values])
    return format_table(["cut", "scene", *(NAMES[measure] for measure in MEASURES)], lines)


def _repeats(repetition: list[dict], own: dict[str, str]) -> str:
    lags = [(str(east), str(north)) for east, north in LAGS]
    at = {(row["scene"], row["variant"], row["east"], row["north"]): row for row in repetition}
    lines = []
    for scene, variant in own.items():
        rows = [at.get((scene, variant, *lag)) for lag in lags]
        if any(rows):
            lines.append([scene, *(_repeat(row) for row in rows)])
    return format_table(["scene", *(f"{east}, {north}" for east, north in lags)], lines)


def _repeat(row: dict | None) -> str:
    if not row or not row["terrain"]:
        return ""
    return f"{float(row['terrain']):.3f}" + (f" ({float(row['exemplar']):.3f})" if row["exemplar"] else "")


def between(row: dict, name: str, digits: int) -> str:
    """A value and in brackets its interval; empty where it is not known."""
    if not row[name]:
        return ""
    value, low, high = (f"{float(row[key]):+.{digits}f}" for key in (name, f"{name}_low", f"{name}_high"))
    return f"{value} ({low}, {high})"
