"""Tables of seams: crops of all experiments, and their differences with 95 % intervals from a bootstrap over clusters.

Crops of the same place of the same strip, or of the same tile, are one cluster: a set has four strips, however often
they occur in the terrain. All views of a place belong to its cluster.
"""

from pathlib import Path

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array

from dav_gswt.files import read_json
from dav_gswt_study import csv_tables, statistics

EVERY = "every"
CELL = ("scene", "seed", "preset", "variant")
PLACES = ("border", "cut", "ceiling")
MEASURES = ("seam_lpips", "psnr", "jump")
KEYS = (
    (*CELL, "view", "ground"),
    ("variant", "baseline", "measure", "scene", "seed"),
)  # keys of the tables seam_summary and seam_ablation
NUMBERS = ("seam_lpips", "psnr", "jump")


def tabulate_crops(cell: dict) -> list[dict]:
    """The crops of an experiment. cell: the values of CELL, `replicate`, and its files `table` and `facts`.

    Crops and clusters of different replicates of the tiles differ: the replicate is part of their names.
    """
    made = read_json(cell["facts"])["provenance"]
    origin = {
        "version": made["version"],
        "weights": made["inputs"].get("lpips", "")[:12],
        "tiles": made["inputs"]["seams"][:12],
    }
    about, number = {key: cell[key] for key in (*CELL, "replicate")}, cell["replicate"]
    return [
        about | row | {key: f"{number}:{row[key]}" if number else row[key] for key in ("crop", "cluster")} | origin
        for row in read_seam_table(cell["table"])
    ]


def read_seam_table(path: Path | str) -> list[dict]:
    """Read a table of seams, measures as numbers; no rows where there is no file yet."""
    rows = csv_tables.read_table(path, numbers=NUMBERS, missing_ok=True)
    return [row | {key: int(row[key]) for key in ("seed", "crop") if row.get(key, "").isdigit()} for row in rows]


def summarise_crops(rows: list[dict]) -> list[dict]:
    """A row for each experiment, view and ground, and one over all views and grounds.

    sets: number of tile sets. border, cut, ceiling: Seam-LPIPS minus its floor. share: cut / ceiling, the way of cuts
    from floor to ceiling; None where the interval of `ceiling` reaches 0.
    """
    table = []
    for cell, mine in _group_rows(rows, CELL).items():
        views = _group_rows(mine, ("view", "ground")) | {(EVERY, EVERY): mine}
        for (view, ground), some in sorted(views.items()):
            about = {"sets": len({row.get("replicate", 0) for row in mine})}
            about |= {key: mine[0][key] for key in ("version", "weights", "tiles")}
            table.append(
                dict(zip(CELL, cell, strict=True)) | {"view": view, "ground": ground} | _summarise(some) | about
            )
    return table


def _summarise(rows: list[dict]) -> dict:
    at = _index_crops(rows)
    sums = {place: subtract_floors(at, place) for place in PLACES}
    out = {}
    for place in ("border", "cut"):
        out |= {f"{place}s": len([r for r in rows if r["place"] == place]), f"{place}_clusters": len(sums[place])}
    all_replicates = zip(PLACES, statistics.bootstrap_clusters(*sums.values()), strict=True)
    replicates = {place: values[:, 0] for place, values in all_replicates}
    for place in PLACES:
        out |= _describe_interval(place, replicates[place])
    ceiling_known = out["ceiling_low"] is not None and out["ceiling_low"] > 0
    out |= _describe_interval("share", replicates["cut"] / replicates["ceiling"] if ceiling_known else None)
    for measure in MEASURES:
        for place in (*PLACES, "floor"):
            known = [r[measure] for r in rows if r["place"] == place and r[measure] is not None]
            out[f"{place}_{measure}"] = float(np.mean(known)) if known else None
    return out


def subtract_floors(at: dict[tuple, dict], place: str) -> statistics.ClusterSums:
    """By cluster: Seam-LPIPS of crops minus that of their floors."""
    pairs = []
    for (name, *where), row in at.items():
        if name == place:
            both = row["seam_lpips"], at["floor", *where]["seam_lpips"]
            pairs.append((row["cluster"], [None] if None in both else [both[0] - both[1]]))
    return statistics.sum_by_cluster(pairs)


def _describe_interval(name: str, values: Float[Array, "replicates"] | None) -> dict:
    table = (None, None, None) if values is None or np.isnan(values[0]) else statistics.percentile_interval(values)
    return dict(zip((name, f"{name}_low", f"{name}_high"), table, strict=True))


def compare_variants(rows: list[dict], baseline: str) -> list[dict]:
    """Every variant minus the baseline: Seam-LPIPS of cuts over the floor, their PSNR and jump, over all views.

    For each scene and seed, and their mean over all, whose interval is over places, not over scenes. Clusters with one
    name (a part of the same tile) are resampled together in both variants.
    """
    cells = _group_rows(rows, ("scene", "seed", "variant"))
    table = []
    for variant in sorted({name for *_, name in cells if name != baseline}):
        for measure in MEASURES:
            differences = []
            for scene, seed, _ in sorted(key for key in cells if key[2] == variant):
                keys = [(scene, seed, name) for name in (variant, baseline)]
                sums = [_sum_variant(cells[key], measure) for key in keys if key in cells]
                if len(sums) < 2 or not all(sums):
                    continue
                first, second = statistics.bootstrap_clusters(*sums)
                differences.append(first[:, 0] - second[:, 0])
                table.append(_tabulate_difference(variant, baseline, measure, scene, seed, differences[-1]))
            if len(differences) > 1:
                table.append(_tabulate_difference(variant, baseline, measure, EVERY, EVERY, np.mean(differences, 0)))
    return table


def _sum_variant(rows: list[dict], measure: str) -> statistics.ClusterSums:
    if measure == "seam_lpips":
        return subtract_floors(_index_crops(rows), "cut")
    return statistics.sum_by_cluster((row["cluster"], [row[measure]]) for row in rows if row["place"] == "cut")


def _tabulate_difference(
    variant: str, baseline: str, measure: str, scene, seed, replicates: Float[Array, "replicates"]
) -> dict:
    about = {"variant": variant, "baseline": baseline, "measure": measure, "scene": scene, "seed": seed}
    return about | _describe_interval("difference", replicates)


def _group_rows(rows: list[dict], keys: tuple[str, ...]) -> dict[tuple, list[dict]]:
    out: dict[tuple, list[dict]] = {}
    for row in rows:
        out.setdefault(tuple(row[key] for key in keys), []).append(row)
    return out


def format_seam_note(crops: Path | str) -> str:
    """The note under a picture of the figure of estimators: Seam-LPIPS of the cuts over their floor, over all views.

    Empty without LPIPS. crops: path of crops.csv.
    """
    sums = subtract_floors(_index_crops(read_seam_table(crops)), "cut")
    if not sums:
        return ""
    value, _, _ = statistics.percentile_interval(statistics.bootstrap_clusters(sums)[0][:, 0])
    return f"\nSeam-LPIPS {value:+.3f}"


def _index_crops(rows: list[dict]) -> dict[tuple, dict]:
    return {(row["place"], row["view"], row["ground"], row["crop"]): row for row in rows}
