"""Tables of the page study/docs/results/results.md. Numbers come from tables or the paper."""

import numpy as np

from dav_gswt_study.markdown import format_table
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


def describe_results(tables: dict[str, list[dict]]) -> dict[str, str]:
    """Tables of the page. tables: rows of timing, lod, sensitivity and ablation, as text."""
    varied = [
        [row["setting"], f"**{row['value']}**" if row["default"] == "True" else row["value"], row["paper_value"]]
        for row in tables["sensitivity"]
    ]
    return {
        "timing": _format_rows(["scene"], [[row["scene"]] for row in tables["timing"]], tables["timing"], TIMING),
        "levels": format_table(*_levels(tables["lod"])),
        "sensitivity": _format_rows(["setting", "value", "paper's value"], varied, tables["sensitivity"], SENSITIVITY),
        "ablation": _format_rows(
            ["sweep", "variant"],
            [[row["sweep"], f"`{row['variant']}`"] for row in tables["ablation"]],
            tables["ablation"],
            ABLATION,
        ),
        "tested": format_table(*_tested(tables["ablation"])),
    }


def _format_rows(names: list[str], named: list[list[str]], rows: list[dict], columns: dict) -> str:
    cells = [[*about, *_cells(row, columns)] for about, row in zip(named, rows, strict=True)]
    return format_table([*names, *_heads(columns)], cells)


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
                found.append([f"`{row['variant']}` minus `{row['less']}`", name, *_test(row, key, digits)])
    head = ["compared", "measure", "pairs", "difference", "95 % interval", "t (df)", "p", "corrected p", "paper's p"]
    return head, found


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
