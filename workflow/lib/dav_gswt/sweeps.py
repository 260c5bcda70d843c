"""The tables of sweeps and of timing, from the files and benchmarks that runs left.

A cell is one run: a scene, a seed and a combination of settings. The rules list a cell's files and the
benchmarks of its jobs; the functions here read them.
"""

import csv
from collections.abc import Iterable, Mapping
from pathlib import Path

from dav_gswt.files import read_json

CELL = ("scene", "seed", "preset", "policy", "prior", "p_drop", "lam", "k", "rounds", "tiling", "tau")
QUALITY = ("psnr", "ssim", "lpips", "worst_psnr", "walker_psnr")  # of the test views
TILES = ("uncertainty", "deep", "levels", "splats", "bundle_mb")
ORDERS = ("orders", "order_mb", "order_db", "compose_s", "sort_s")  # of `bundle.orders`
ROUND_JOBS = ("score", "select", "update")  # jobs of each round: their seconds are means over the rounds
JOBS = ("levels", "cut", "bundle", "stills")
TIMES = ("coarse_s", *(f"{job}_s" for job in ROUND_JOBS), "recon_s", *(f"{job}_s" for job in JOBS), "peak_mb")
COLUMNS = ("psnr_is", "photos", "gaussians", *QUALITY, *TILES, *ORDERS, *TIMES, "version", "renderer", "field")
ASIDE = ("oblique", "walker")  # groups of test views away from where photos may be taken
MEGA = 1e6


def tabulate_cell(cell: dict) -> dict:
    """Make the row of a cell; what was not measured is None.

    Columns: `psnr_is`, colour-corrected for photos, whose exposure changes, and else raw; `uncertainty`, the mean over
    the tiles; `deep`, the share of tiles that are drawn in all orders; `bundle_mb` of the parts; those of ORDERS are
    `bundle.orders.measure_orders`'s. Seconds are those of whole jobs; `recon_s` sums all jobs that lead to the
    field, except taking photos.
    cell: the keys of CELL, `corrected`, `files` (metrics, manifest, orders) and `times` (benchmark files by job).
    """
    files, row = cell["files"], {key: cell[key] for key in CELL} | dict.fromkeys(COLUMNS)
    row["psnr_is"] = "colour-corrected" if cell["corrected"] else "raw"
    if "metrics" in files:
        row |= read_quality(files["metrics"], cell["corrected"])
    if "manifest" in files:
        row |= read_tiles(files["manifest"])
    if "orders" in files:
        row |= {key: read_json(files["orders"])[key] for key in ORDERS}
    return row | sum_times(cell["times"])


def read_quality(path: Path | str, corrected: bool) -> dict:
    """Read photos, Gaussians, QUALITY and provenance from a metrics.json. corrected: PSNR after the colour fit."""
    metrics = read_json(path)
    provenance = metrics["provenance"]
    found = select_metrics(metrics, "psnr_colour_corrected" if corrected else "psnr")
    found |= {key: metrics[key] for key in ("photos", "gaussians")}
    return found | describe_origin(provenance) | {"field": provenance["inputs"]["field"][:12]}


def select_metrics(metrics: dict, psnr: str) -> dict:
    """Select QUALITY from the contents of a metrics.json, PSNR by its key.

    The values are means over the test views from where photos may be taken, if these views are a group, else over all.
    """
    groups = metrics["groups"]
    mine = next((groups[name] for name in groups if name not in ASIDE), metrics)
    found = {"psnr": mine[psnr], "ssim": mine["ssim"], "lpips": mine["lpips"]}
    found |= {"worst_psnr": mine["worst_decile"][psnr]}
    return found | {"walker_psnr": groups["walker"][psnr] if "walker" in groups else None}


def read_tiles(path: Path | str) -> dict:
    """Read TILES and provenance from a bundle's manifest."""
    manifest = read_json(path)
    tiles, every = manifest["tiles"], len(manifest["directions"])
    return {
        "uncertainty": sum(tile["uncertainty"] for tile in tiles) / len(tiles),
        "deep": sum(len(tile["orders"]) == every for tile in tiles) / len(tiles),
        "levels": len(manifest["levels"]),
        "splats": sum(chunk["count"] for tile in tiles for chunk in tile["chunks"]),
        "bundle_mb": sum(part["bytes"] for part in manifest["parts"]) / MEGA,
    } | describe_origin(manifest["provenance"])


def describe_origin(provenance: Mapping) -> dict:
    """Version and renderer of a provenance, as tables write them."""
    renderer = " ".join(str(value) for value in provenance["renderer"].values())
    return {"version": provenance["version"], "renderer": renderer}


def sum_times(jobs: Mapping[str, list[str]]) -> dict:
    """Sum the seconds of jobs from their benchmarks, and find the largest memory; None where one is missing."""
    runs = {job: [read_benchmark(path) for path in paths] for job, paths in jobs.items() if paths}
    seconds = {job: sum_or_none(run and run[0] for run in found) for job, found in runs.items()}
    out: dict[str, float | None] = dict.fromkeys(TIMES) | {f"{job}_s": seconds.get(job) for job in ("coarse", *JOBS)}
    for job in ROUND_JOBS:
        total = seconds.get(job)
        out[f"{job}_s"] = None if total is None else total / len(runs[job])
    parts = [seconds[job] for job in ("coarse", *ROUND_JOBS) if job in runs]
    out["recon_s"] = sum_or_none(parts) if parts else None
    memory = [run[1] for found in runs.values() for run in found if run and run[1] is not None]
    return out | {"peak_mb": max(memory, default=None)}


def read_benchmark(path: Path | str) -> tuple[float, float | None] | None:
    """Read seconds and megabytes of a job; megabytes are None for a job that ended at once."""
    if not Path(path).is_file():
        return None
    with Path(path).open(newline="", encoding="utf-8") as text:
        row = next(csv.DictReader(text, delimiter="\t"))
    memory = row.get("max_rss", "")
    return float(row["s"]), float(memory) if memory.replace(".", "", 1).isdigit() else None


def sum_or_none(values: Iterable[float | None]) -> float | None:
    """Sum; None if a value is None."""
    found = list(values)
    return None if None in found else sum(value for value in found if value is not None)


def tabulate_timing(cells: list[dict]) -> list[dict]:
    """Make the timing table: for each scene and preset the means over its seeds.

    Columns: `splats_m`, millions of Gaussians of all tiles and levels; `recon_min`, minutes from registered photos to
    the last field, except taking photos; seconds of levels and of cutting tiles; `presort_s`, CPU seconds of
    composing all tiles and sorting them for all their directions; `peak_mb`. Source: DAV-GSWT, table of timing.
    """
    rows = [tabulate_cell(cell) for cell in cells]
    found = []
    for scene, preset in dict.fromkeys((row["scene"], row["preset"]) for row in rows):
        mine = [row for row in rows if (row["scene"], row["preset"]) == (scene, preset)]
        splats, recon = compute_mean(mine, "splats"), compute_mean(mine, "recon_s")
        row = {"scene": scene, "preset": preset, "seeds": len(mine), "photos": compute_mean(mine, "photos")}
        row |= {"splats_m": splats and splats / MEGA, "recon_min": recon and recon / 60}
        row |= {key: compute_mean(mine, key) for key in ("levels_s", "cut_s")}
        parts = [compute_mean(mine, key) for key in ("compose_s", "sort_s")]
        found.append(row | {"presort_s": sum_or_none(parts), "peak_mb": compute_mean(mine, "peak_mb")})
    return found


def compute_mean(rows: list[dict], key: str) -> float | None:
    """Compute the mean of a column over the rows that have a value."""
    values = [row[key] for row in rows if row[key] is not None]
    return sum(values) / len(values) if values else None
