"""The table of a sweep: a row for each experiment with its settings, measures, costs and provenance."""

import csv
from pathlib import Path

from dav_gswt.files import read_json
from dav_gswt_study import csv_tables
from dav_gswt_study.comparison import curves
from dav_gswt_study.seams import summary
from dav_gswt_study.seams import tables as crops
from dav_gswt_study.statistics import sum_or_none
from dav_gswt_study.sweeps.grid import CELL

KEY = ("sweep", *CELL)  # what tells rows apart
ABOUT = ("samples", "steps")  # of the prior, which its name hides
VIEWS = ("photos", "gaussians", *curves.MEASURES)  # of the test views
TILES = ("uncertainty", "deep", "levels", "splats", "orders", "bundle_mb")
SEAMS = ("seam_lpips", "seam_lpips_low", "seam_lpips_high", "seam_psnr", "seam_jump", "seam_density")
ROUNDS = ("score", "select", "update")  # jobs that every round has: seconds a round
ONCE = ("coarse", "levels", "cut", "bundle", "stills")
TIMES = ("coarse_s", *(f"{job}_s" for job in ROUNDS), "recon_s", *(f"{job}_s" for job in ONCE[1:]), "peak_mb")
NUMBERS = (*ABOUT, *VIEWS, *TILES, *SEAMS, *TIMES)
SOURCES = ("psnr_is", "version", "renderer", "field", "tiles")
MEGA = 1e6


def tabulate_cell(cell: dict) -> dict:
    """The row of an experiment; what was not measured is None.

    psnr_is: `colour-corrected` of photos, whose exposure changes, else `raw`. uncertainty: mean over the tiles; deep:
    share of them that keep all orders; orders: kept of all tiles and levels; bundle_mb: of the chunks a page loads.
    seam_lpips: Seam-LPIPS of cuts less their floor over all views, with its 95 % interval over places; seam_psnr and
    seam_jump of these cuts; seam_density: share of their length through strong gradients. Seconds are those of whole
    jobs, score_s, select_s and update_s the mean over the rounds; recon_s: all that leads to the field but taking the
    photos. peak_mb: the largest memory of any of these jobs.
    cell: what KEY and ABOUT name, `varied`, `corrected`, `files` of what was measured, `times`: benchmarks by job.
    """
    files, found = cell["files"], {key: cell[key] for key in (*KEY, *ABOUT)}
    found |= {f"varied_{k}": value for k, value in enumerate(cell["varied"].values())}
    found |= {"psnr_is": "colour-corrected" if cell["corrected"] else "raw"}
    found |= _read_views(files["metrics"], cell["corrected"]) if "metrics" in files else {}
    found |= _read_tiles(files["manifest"]) if "manifest" in files else {}
    found |= _read_seams(cell | files) if "crops" in files else {}
    return dict.fromkeys(list_columns(len(cell["varied"]))) | found | sum_times(cell["times"])


def list_columns(axes: int) -> tuple[str, ...]:
    """The table's columns, in order. axes: how many settings are varied together."""
    return (*KEY, *(f"varied_{k}" for k in range(axes)), *ABOUT, *VIEWS, *TILES, *SEAMS, *TIMES, *SOURCES)


def read_sweep(path: Path | str) -> list[dict]:
    """Read a sweep's table, NUMBERS as floats, None where empty; no rows where there is no file yet."""
    return csv_tables.read_table(path, numbers=NUMBERS, missing_ok=True)


def sum_times(jobs: dict[str, list[str]]) -> dict:
    """Seconds by job and the largest memory, of benchmarks; None where one of them is not there."""
    runs = {job: [read_benchmark(path) for path in paths] for job, paths in jobs.items() if paths}
    seconds = {job: sum_or_none(one and one[0] for one in found) for job, found in runs.items()}
    out: dict[str, float | None] = dict.fromkeys(TIMES) | {f"{job}_s": seconds.get(job) for job in ONCE}
    for job in ROUNDS:
        total = seconds.get(job)
        out[f"{job}_s"] = None if total is None else total / len(runs[job])
    parts = [seconds[job] for job in ("coarse", *ROUNDS) if job in runs]
    out["recon_s"] = sum_or_none(parts) if parts else None
    memory = [one[1] for found in runs.values() for one in found if one and one[1] is not None]
    return out | {"peak_mb": max(memory, default=None)}


def read_benchmark(path: str) -> tuple[float, float | None] | None:
    """Seconds and megabytes of a job; memory is None for a job that was over at once."""
    if not Path(path).is_file():
        return None
    with Path(path).open(newline="", encoding="utf-8") as text:
        row = next(csv.DictReader(text, delimiter="\t"))
    memory = row.get("max_rss", "")
    return float(row["s"]), float(memory) if memory.replace(".", "", 1).isdigit() else None


def _read_views(path: str, corrected: bool) -> dict:
    metrics = read_json(path)
    about = metrics["provenance"]
    found = {key: metrics[key] for key in ("photos", "gaussians")}
    found |= curves.select_metrics(metrics, "psnr_colour_corrected" if corrected else "psnr")
    return found | describe_origin(about) | {"field": about["inputs"]["field"][:12]}


def _read_tiles(path: str) -> dict:
    manifest = read_json(path)
    tiles = manifest["tiles"]
    chunks = [chunk for tile in tiles for chunk in tile["chunks"]]
    deep = [len(tile["chunks"][0]["orders"]) == len(manifest["directions"]) for tile in tiles]
    return {
        "uncertainty": sum(tile["uncertainty"] for tile in tiles) / len(tiles),
        "deep": sum(deep) / len(deep),
        "levels": len(manifest["levels"]),
        "splats": sum(chunk["count"] for chunk in chunks),
        "orders": sum(len(chunk["orders"]) for chunk in chunks),
        "bundle_mb": sum(chunk["bytes"] for chunk in chunks) / MEGA,
    } | describe_origin(manifest["provenance"])


def _read_seams(cell: dict) -> dict:
    rows = crops.tabulate_crops(cell | {"table": cell["crops"], "variant": cell["tiling"], "replicate": 0})
    row = next(r for r in summary.summarise_crops(rows) if r["view"] == r["ground"] == summary.EVERY)
    named = {"seam_lpips": "cut", "seam_lpips_low": "cut_low", "seam_lpips_high": "cut_high"}
    found = {key: row[name] for key, name in (named | {"seam_psnr": "cut_psnr", "seam_jump": "cut_jump"}).items()}
    facts = read_json(cell["facts"])
    return found | {"seam_density": facts["dense"], "tiles": row["tiles"]} | describe_origin(facts["provenance"])


def describe_origin(provenance: dict) -> dict:
    """Version and renderer, as tables write them."""
    renderer = " ".join(str(value) for value in provenance["renderer"].values())
    return {"version": provenance["version"], "renderer": renderer}
