"""The page study/docs/results/results.md: a study's tables and figures. Numbers come from tables or the paper."""

from pathlib import Path

import numpy as np

from dav_gswt.files import atomic_file
from dav_gswt_study.markdown import format_table
from dav_gswt_study.statistics import two_sided_p
from dav_gswt_study.tables import paper

UNKNOWN = ""
TIMING = {
    "splats (M)": ("splats_m", 2, "splats_m"),
    "reconstruction (min)": ("recon_min", 2, "recon_min"),
    "tiles (s)": ("cut_s", 1, "cut_s"),
    "pre-sorting (s)": ("presort_s", 1, "presort_s"),
    "render (ms)": ("render_ms", 2, "render_ms"),
    "sort (ms)": ("sort_ms", 2, "sort_ms"),
    "update (ms)": ("update_ms", 2, "update_ms"),
}  # of a column its key, digits, and the paper's key
SENSITIVITY = {
    "PSNR (dB)": ("psnr", 2, "psnr"),
    "LPIPS": ("lpips", 3, None),
    "Seam-LPIPS over its floor": ("seam_lpips", 4, "seam_lpips"),
    "scoring (s)": ("score_s", 1, "score_s"),
    "orders": ("orders", 0, None),
    "bundle (MB)": ("bundle_mb", 1, None),
    "three stills (s)": ("stills_s", 1, None),
    "render (ms)": ("render_ms", 2, None),
}
ABLATION = {
    "photos": ("photos", 0, None),
    "PSNR (dB)": ("psnr", 2, "psnr"),
    "Seam-LPIPS over its floor": ("seam_lpips", 4, "seam_lpips"),
    "seam density": ("seam_density", 3, None),
    "scoring (s)": ("score_s", 1, "score_s"),
    "memory (MB)": ("peak_mb", 0, None),
}
TESTED = {"PSNR (dB)": ("psnr", 2), "Seam-LPIPS": ("seam_lpips", 4)}


def write_results(path: Path | str, tables: dict[str, list[dict]], figures: dict[str, str]) -> None:
    """The page of `text`, as a file."""
    with atomic_file(path) as part:
        part.write_text(format_results(tables, figures), encoding="utf-8")


def format_results(tables: dict[str, list[dict]], figures: dict[str, str]) -> str:
    """tables: rows of timing, lod, sensitivity and ablation. figures: paths from the page, by what they show."""
    parts = [
        "# Results",
        "Made by `snakemake study/docs/results/results.md` from "
        "`study/docs/data/{timing,lod,sensitivity,ablation}.csv`; do not edit. "
        "± is a standard deviation over seeds; PSNR of photos is colour-corrected, of synthetic scenes raw. Columns "
        "“paper” repeat what is printed there, of other scenes, photos and machines: they stand beside ours for "
        "orientation, not for comparison.",
        "## Timing",
        format_table(["scene", *_heads(TIMING)], [[row["scene"], *_cells(row, TIMING)] for row in tables["timing"]]),
        "Seconds and minutes hold for the machine and for what ran beside the jobs. "
        "Reconstruction is scoring, choosing and fitting, without the taking of photos; render, sort and update are "
        "the page's in a headless browser, which without a graphics card draws in software "
        "(`study/docs/data/frames.csv`; "
        "empty unless `study.tables.viewer` asks for them). "
        "The paper's percentages are left out: it does not say of what they are.",
        "## Levels of detail",
        format_table(*_levels(tables["lod"])),
        "## Sensitivity",
        format_table(
            ["setting", "value", "paper's value", *_heads(SENSITIVITY)],
            [[r["setting"], _bold(r), r["paper_value"], *_cells(r, SENSITIVITY)] for r in tables["sensitivity"]],
        ),
        "In bold the value that is not varied elsewhere. Seam-LPIPS is of one tile set a scene, and differs by some "
        "thousandths from one set to the next: `study/docs/results/seams.md` has more sets and intervals.",
        "## Ablation",
        format_table(
            ["sweep", "variant", *_heads(ABLATION)],
            [[row["sweep"], f"`{row['variant']}`", *_cells(row, ABLATION)] for row in tables["ablation"]],
        ),
        "Seam density is the share of cuts that run through the strongest quarter of the ground's gradients.",
        "Differences from the baseline, paired by scene and seed: mean, 95 % bootstrap interval, t (degrees of "
        "freedom), p, and p raised for how many variants were compared (Holm).",
        format_table(*_tested(tables["ablation"])),
        _slips(),
        "## Figures",
        *(f"![{shown}]({path})\n\n{shown}" for shown, path in figures.items()),
    ]
    return "\n\n".join(part.rstrip("\n") for part in parts) + "\n"


def _heads(columns: dict) -> list[str]:
    return [head for name, (_, _, printed) in columns.items() for head in ([name, "paper"] if printed else [name])]


def _cells(row: dict, columns: dict) -> list[str]:
    found = []
    for key, digits, printed in columns.values():
        found.append(_spread(row.get(key), row.get(f"{key}_sd"), digits))
        found += [row.get(f"paper_{printed}") or UNKNOWN] if printed else []
    return found


def _spread(value: str | None, deviation: str | None, digits: int) -> str:
    if not value:
        return UNKNOWN
    return f"{float(value):.{digits}f}" + (f" ± {float(deviation):.{digits}f}" if deviation else "")


def _bold(row: dict) -> str:
    return f"**{row['value']}**" if row["default"] == "True" else row["value"]


def _levels(rows: list[dict]) -> tuple[list[str], list[list[str]]]:
    """Mean scale and count a tile, level by level; the paper's of the same family under ours."""
    levels = sorted({int(row["level"]) for row in rows})
    found = []
    for scene in dict.fromkeys(row["scene"] for row in rows):
        for key, form in (("mean_scale", "{:.4f}"), ("count", "{:.0f}")):
            at = {n: [float(r[key]) for r in rows if r["scene"] == scene and int(r["level"]) == n] for n in levels}
            means = [form.format(np.mean(values)) if values else UNKNOWN for values in at.values()]
            found.append([scene, key.replace("_", " "), *means])
            printed = paper.find_printed("lod", scene.split("_")[0], tuple(f"{key.split('_')[-1]}{n}" for n in levels))
            if any(printed.values()):
                found.append([f"paper, {scene.split('_')[0]}", "", *(value or UNKNOWN for value in printed.values())])
    return ["scene", "", *(f"level {n}" for n in levels)], found


def _tested(rows: list[dict]) -> tuple[list[str], list[list[str]]]:
    found = []
    for row in rows:
        for name, (key, digits) in TESTED.items():
            if row[f"{key}_difference"]:
                found.append([f"`{row['variant']}` less `{row['less']}`", name, *_test(row, key, digits)])
    return ["", "measure", "pairs", "difference", "95 %", "t (df)", "p", "Holm", "paper's p"], found


def _test(row: dict, key: str, digits: int) -> list[str]:
    def format_value(name: str, form: str) -> str:
        value = row[f"{key}_{name}"]
        return form.format(float(value)) if value else UNKNOWN

    number = f"{{:+.{digits}f}}"
    interval = f"({format_value('low', number)}, {format_value('high', number)})" if row[f"{key}_low"] else UNKNOWN
    t = f"{format_value('t', '{:.2f}')} ({row[f'{key}_df']})" if row[f"{key}_t"] else UNKNOWN
    printed = row["paper_p"] or UNKNOWN
    about = [row[f"{key}_units"], format_value("difference", number), interval, t]
    return [*about, format_value("p", "{:.3f}"), format_value("holm", "{:.3f}"), printed if key == "psnr" else UNKNOWN]


def _slips() -> str:
    """What the paper's text says and its numbers do not."""
    printed = paper.read_paper()
    t, df = (paper.parse_number(printed["ablation", "caption", key]) for key in ("t", "df"))
    start, k, rounds, views = (
        paper.parse_number(printed["protocol", "views", key]) for key in ("start", "k", "rounds", "all")
    )
    taken = start + k * rounds
    return (
        f"Not copied from the paper: its t = {t:g} with {df:.0f} degrees of freedom is p = "
        f"{two_sided_p(t, int(df)):.3f}, not p < 0.01; {taken:.0f} of {views:.0f} views are "
        f"{views / taken:.1f} times fewer, not ten."
    )
