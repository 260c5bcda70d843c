"""From crops to what can be said of a tile set: differences with 95 % intervals, by a bootstrap over clusters.

Crops that show the same place of the same strip, or of the same tile, are one cluster: there are four strips, however
often they are laid, and the bootstrap draws clusters, never crops. All views of a place belong to its cluster.
"""

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array

from dav_gswt.study import statistics

EVERY = "every"
CELL = ("scene", "seed", "preset", "variant")
PLACES = ("border", "cut", "ceiling")
MEASURES = ("seam_lpips", "psnr", "jump")


def summary(rows: list[dict]) -> list[dict]:
    """A row for each cell, view and ground, and one over all of both.

    sets: tile sets that were drawn. border, cut, ceiling: Seam-LPIPS of these less their floors. share: of the way from
    floor to ceiling that cuts go, cut / ceiling; empty where the interval of `ceiling` reaches 0, as then nothing can
    be told.
    """
    found = []
    for cell, mine in _grouped(rows, CELL).items():
        views = _grouped(mine, ("view", "ground")) | {(EVERY, EVERY): mine}
        for (view, ground), some in sorted(views.items()):
            about = {"sets": len({row.get("replicate", 0) for row in mine})}
            about |= {key: mine[0][key] for key in ("version", "weights", "tiles")}
            found.append(dict(zip(CELL, cell, strict=True)) | {"view": view, "ground": ground} | _told(some) | about)
    return found


def _told(rows: list[dict]) -> dict:
    at = {(row["place"], row["view"], row["ground"], row["crop"]): row for row in rows}
    sums = {place: of_crops(at, place) for place in PLACES}
    out = {}
    for place in ("border", "cut"):
        out |= {f"{place}s": len([r for r in rows if r["place"] == place]), f"{place}_clusters": len(sums[place])}
    draws = {
        place: values[:, 0] for place, values in zip(PLACES, statistics.bootstrap_clusters(*sums.values()), strict=True)
    }
    for place in PLACES:
        out |= _named(place, draws[place])
    sure = out["ceiling_low"] is not None and out["ceiling_low"] > 0
    out |= _named("share", draws["cut"] / draws["ceiling"] if sure else None)
    for measure in MEASURES:
        for place in (*PLACES, "floor"):
            known = [r[measure] for r in rows if r["place"] == place and r[measure] is not None]
            out[f"{place}_{measure}"] = float(np.mean(known)) if known else None
    return out


def of_crops(at: dict[tuple, dict], place: str) -> statistics.ClusterSums:
    """By cluster: Seam-LPIPS of crops less that of their floors."""
    pairs = []
    for (name, *where), row in at.items():
        if name == place:
            both = row["seam_lpips"], at["floor", *where]["seam_lpips"]
            pairs.append((row["cluster"], [None] if None in both else [both[0] - both[1]]))
    return statistics.sum_by_cluster(pairs)


def _named(name: str, values: Float[Array, "draws"] | None) -> dict:
    found = (None, None, None) if values is None or np.isnan(values[0]) else statistics.percentile_interval(values)
    return dict(zip((name, f"{name}_low", f"{name}_high"), found, strict=True))


def ablation(rows: list[dict], baseline: str) -> list[dict]:
    """Every variant less the baseline: cuts' Seam-LPIPS over the floor, their PSNR and jump, over all views.

    Of each scene and seed, and over all: the mean of these, whose interval tells of other places, not other scenes.
    Clusters of both variants that have one name (a part of the same tile) are drawn together.
    """
    cells = _grouped(rows, ("scene", "seed", "variant"))
    found = []
    for variant in sorted({name for *_, name in cells if name != baseline}):
        for measure in MEASURES:
            all_draws = []
            for scene, seed, _ in sorted(key for key in cells if key[2] == variant):
                pair = [cells.get((scene, seed, name)) for name in (variant, baseline)]
                if not all(pair) or not all(sums := [_of_variant(some, measure) for some in pair]):
                    continue
                first, second = statistics.bootstrap_clusters(*sums)
                all_draws.append(first[:, 0] - second[:, 0])
                found.append(_less(variant, baseline, measure, scene, seed, all_draws[-1]))
            if len(all_draws) > 1:
                found.append(_less(variant, baseline, measure, EVERY, EVERY, np.mean(all_draws, 0)))
    return found


def _of_variant(rows: list[dict], measure: str) -> statistics.ClusterSums:
    if measure == "seam_lpips":
        at = {(row["place"], row["view"], row["ground"], row["crop"]): row for row in rows}
        return of_crops(at, "cut")
    return statistics.sum_by_cluster((row["cluster"], [row[measure]]) for row in rows if row["place"] == "cut")


def _less(variant: str, baseline: str, measure: str, scene, seed, draws: Float[Array, "draws"]) -> dict:
    about = {"variant": variant, "baseline": baseline, "measure": measure, "scene": scene, "seed": seed}
    return about | _named("difference", draws)


def _grouped(rows: list[dict], keys: tuple[str, ...]) -> dict[tuple, list[dict]]:
    out: dict[tuple, list[dict]] = {}
    for row in rows:
        out.setdefault(tuple(row[key] for key in keys), []).append(row)
    return out
