"""What presets cost and what they are worth: study/docs/data/preset_costs.csv and study/docs/results/presets.md.

All else is as the config has it: policy, rounds, tiling, materials.
"""

from itertools import chain

import numpy as np

from dav_gswt.files import read_json
from dav_gswt.sweeps import MEGA, describe_origin, read_benchmark, select_metrics, sum_or_none
from dav_gswt_study.machine import describe_machine
from dav_gswt_study.markdown import format_number, format_table

PARTS = {"fits": "fits", "views": "scores and choice of views", "tiles": "materials, levels, tiles, bundle"}
NUMBERS = ("photos", "gaussians", "psnr", "ssim", "lpips", *(f"{part}_s" for part in PARTS), "seconds", "peak_mb")
NUMBERS += ("bundle_mb", "cores", "size")


def tabulate_presets(cells: list[dict], size: int) -> list[dict]:
    """A row for each scene and preset.

    psnr: of test photos, after their exposure is fitted where they are real. fits_s, views_s, tiles_s: seconds of whole
    jobs, from the start photos to the bundle; seconds: their sum. peak_mb: the largest memory of any of these jobs.
    bundle_mb: of all parts, in megabytes. size: of the test photos, at most.
    cells: `scene`, `preset`, `corrected`, `files` (metrics, manifest), and `times`, benchmarks by PARTS.
    """
    return [_tabulate_cell(cell, size) for cell in cells]


def _tabulate_cell(cell: dict, size: int) -> dict:
    metrics, manifest = (read_json(cell["files"][name]) for name in ("metrics", "manifest"))
    found = select_metrics(metrics, "psnr_colour_corrected" if cell["corrected"] else "psnr")
    row = {"scene": cell["scene"], "preset": cell["preset"], "photos": metrics["photos"]}
    row |= {"gaussians": metrics["gaussians"]} | {key: found[key] for key in ("psnr", "ssim", "lpips")}
    runs = {part: [read_benchmark(path) for path in cell["times"][part]] for part in PARTS}
    seconds = {part: sum_or_none(one and one[0] for one in found) for part, found in runs.items()}
    memory = [one[1] for one in chain.from_iterable(runs.values()) if one and one[1] is not None]
    row |= {f"{part}_s": value for part, value in seconds.items()} | {"seconds": sum_or_none(seconds.values())}
    row |= {"peak_mb": max(memory, default=None), "bundle_mb": sum(part["bytes"] for part in manifest["parts"]) / MEGA}
    return row | {"size": size} | describe_origin(metrics["provenance"]) | describe_machine()


def describe_presets(rows: list[dict]) -> dict:
    """Values of the page's template. rows: as `tabulate_presets` has them, NUMBERS as floats."""
    presets, scenes = ([*dict.fromkeys(row[key] for row in rows)] for key in ("preset", "scene"))
    tables = {scene: format_table(*_tabulate_scene([row for row in rows if row["scene"] == scene])) for scene in scenes}
    return {"first": rows[0], "means": format_table(*_tabulate_means(rows, presets)), "scenes": tables}


def summarise_preset(rows: list[dict], preset: str) -> dict:
    """Seconds of a preset as a share of those of `standard`, and what it loses: means over the scenes, and the most."""
    share, db, lpips = [], [], []
    for own in (row for row in rows if row["preset"] == preset):
        mine = {row["preset"]: row for row in rows if row["scene"] == own["scene"]}
        share.append(own["seconds"] / mine["standard"]["seconds"])
        db.append(max(row["psnr"] for row in mine.values()) - own["psnr"])
        lpips.append(own["lpips"] - min(row["lpips"] for row in mine.values()))
    return {
        "share": float(np.exp(np.log(share).mean())),
        "db": float(np.mean(db)),
        "most_db": max(db),
        "lpips": float(np.mean(lpips)),
        "most_lpips": max(lpips),
    }


def _tabulate_means(rows: list[dict], presets: list[str]) -> tuple[list[str], list[list[str]]]:
    head = ["preset", "seconds / seconds of `standard`", "mean loss of PSNR (dB)", "largest loss of PSNR (dB)"]
    head += ["mean loss of LPIPS", "largest loss of LPIPS"]
    found = []
    for preset in presets:
        mean = summarise_preset(rows, preset)
        losses = [(mean[key], 2) for key in ("db", "most_db")] + [(mean[key], 3) for key in ("lpips", "most_lpips")]
        found.append([f"`{preset}`", f"{mean['share']:.2f}", *(format_number(*loss) for loss in losses)])
    return head, found


def _tabulate_scene(rows: list[dict]) -> tuple[list[str], list[list[str]]]:
    form = {"seconds": 0, **{f"{part}_s": 0 for part in PARTS}, "psnr": 2, "ssim": 3, "lpips": 3, "photos": 0}
    form |= {"gaussians": 0, "peak_mb": 0, "bundle_mb": 1}
    head = ["preset", "seconds of all jobs", *(f"seconds of {part}" for part in PARTS.values())]
    head += ["PSNR (dB)", "SSIM", "LPIPS", "photos", "Gaussians", "peak memory (MB)", "bundle (MB)"]
    return head, [
        [f"`{row['preset']}`", *(format_number(row[key], digits) for key, digits in form.items())] for row in rows
    ]
