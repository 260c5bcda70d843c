"""From curves to results: a row a cell, and every policy less the baseline, paired, with intervals."""

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array

from dav_gswt.sweeps import sum_or_none
from dav_gswt_study.comparison.curves import CELL
from dav_gswt_study.statistics import bootstrap_paired

EVERYTHING = "all"  # the policy that takes the whole pool: what there is to reach, and no curve
EVERY = "every"  # scene, in the rows over all of them
UNIT = ("scene", "preset", "seed", "k")
TIE = 0.05  # dB: two fits of the same photos differ by less
JUDGED = {"psnr": 1, "worst_psnr": 1, "walker_psnr": 1, "lpips": -1}  # measures of curves: 1 where more is better


def summarise_cells(curves: list[dict]) -> list[dict]:
    """A row a cell: nAUC, PSNR and the other measures of its last round, seconds.

    gap: dB under all photos; empty where all were not tried.
    """
    best = {unit[:3]: rounds[-1]["psnr"] for unit, policy, rounds in _group_cells(curves) if policy[0] == EVERYTHING}
    table = []
    for unit, policy, rounds in _group_cells(curves):
        if policy[0] == EVERYTHING:
            continue
        photos, psnr = (np.array([row[key] for row in rounds], float) for key in ("photos", "psnr"))
        goal, last = best.get(unit[:3]), rounds[-1]
        row = {key: last[key] for key in CELL} | {"photos": last["photos"], "nauc": compute_nauc(photos, psnr)}
        row |= {key: last[key] for key in ("psnr", "ssim", "lpips", "worst_psnr", "walker_psnr")}
        row |= {f"nauc_{key}": _area(photos, rounds, key) for key in JUDGED if key != "psnr"}
        row |= {"gap": None if goal is None else goal - last["psnr"]}
        table.append(row | {"seconds": sum_or_none(r["seconds"] for r in rounds[1:])})
    return table


def compare_to_baseline(table: list[dict], baseline: str) -> list[dict]:
    """Every policy less the baseline by the nAUC of each measure of JUDGED: over all scenes, and of each scene and k
    alone. A difference above 0 is better, of LPIPS too.

    Cells are paired by scene, preset, seed, k and the photos that they end with. wins, ties (within TIE), losses: of
    how many pairs. One cell alone has no interval.
    """
    units = [(*(row[key] for key in UNIT), row["photos"]) for row in table]
    rows = []
    for measure, sign in JUDGED.items():
        column = "nauc" if measure == "psnr" else f"nauc_{measure}"
        cells = {
            (unit, _policy_key(row)): sign * row[column]
            for unit, row in zip(units, table, strict=True)
            if row[column] is not None
        }
        rows += [{"measure": measure} | row for row in _compare_cells(cells, baseline)]
    return rows


def compare_groups(table: list[dict], baseline: str, groups: dict[str, str]) -> list[dict]:
    """Every policy less the baseline over the scenes of each group. groups: the group of each scene; others have none.

    A row as of `compare_to_baseline`, with `group` for the scene; groups in the order of `groups`.
    """
    found = []
    for group in dict.fromkeys(groups.values()):
        mine = [row for row in table if groups.get(row["scene"]) == group]
        rows = compare_to_baseline(mine, baseline) if any(row["policy"] == baseline for row in mine) else []
        found += [row | {"group": group} for row in rows if row["scene"] == EVERY]
    return found


def _compare_cells(cells: dict[tuple, float], baseline: str) -> list[dict]:
    """Every policy less the baseline, by one measure."""
    base = {unit: value for (unit, policy), value in cells.items() if policy[0] == baseline}
    rows = []
    for policy in sorted({policy for _, policy in cells if policy[0] != baseline}):
        pairs = {unit: cells[unit, policy] - base[unit] for unit in sorted(base) if (unit, policy) in cells}
        if not pairs:
            continue
        rows.append(_comparison_row(policy, EVERY, "", pairs))
        for scene, k in sorted({(unit[0], unit[3]) for unit in pairs}):
            rows.append(
                _comparison_row(policy, scene, k, {u: v for u, v in pairs.items() if (u[0], u[3]) == (scene, k)})
            )
    return rows


def _area(photos: Float[Array, "t"], rounds: list[dict], measure: str) -> float | None:
    """The nAUC of a measure; None where a round lacks it."""
    values = [row[measure] for row in rounds]
    return None if None in values else compute_nauc(photos, np.array(values, float))


def compute_nauc(photos: Float[Array, "t"], psnr: Float[Array, "t"]) -> float:
    """Normalised area under PSNR against photos: its mean over the budget, by the trapezoidal rule, in dB.

    photos: rising, from the start to the budget. Raises: ValueError: fewer than two rounds, photos that do not rise, a
    value that is not finite. Source: nAUC = trapezoid(PSNR, n_0..B) / (B - n_0).
    """
    if len(photos) < 2:
        raise ValueError(f"a curve needs at least two rounds, not {len(photos)}")
    if not (np.diff(photos) > 0).all() or not np.isfinite(psnr).all():
        raise ValueError("a curve's photos must rise from round to round, and its values be finite")
    return float(np.trapezoid(psnr, photos) / (photos[-1] - photos[0]))


def _comparison_row(policy: tuple[str, ...], scene: str, k: int | str, pairs: dict[tuple, float]) -> dict:
    by_scene: dict[str, list[float]] = {}
    for unit, value in pairs.items():
        by_scene.setdefault(unit[0], []).append(value)
    mean, *ends = bootstrap_paired({name: np.array(values) for name, values in by_scene.items()})
    low, high = ends if len(pairs) > 1 else (None, None)  # nothing tells how far another cell would be from this one
    wins, losses = sum(value > TIE for value in pairs.values()), sum(value < -TIE for value in pairs.values())
    named = dict(zip(("policy", "prior", "p_drop", "lam"), policy, strict=True))
    found = {"units": len(pairs), "mean": mean, "low": low, "high": high}
    return (
        named | {"scene": scene, "k": k} | found | {"wins": wins, "ties": len(pairs) - wins - losses, "losses": losses}
    )


def _policy_key(row: dict) -> tuple[str, ...]:
    return tuple(str(row[key]) for key in ("policy", "prior", "p_drop", "lam"))


def _group_cells(curves: list[dict]):
    """Unit, policy and rounds of every cell that has at least two rounds."""
    cells: dict[tuple, list[dict]] = {}
    for row in sorted(curves, key=lambda row: row["round"]):
        cells.setdefault((tuple(row[key] for key in UNIT), _policy_key(row)), []).append(row)
    return [(unit, policy, rounds) for (unit, policy), rounds in sorted(cells.items()) if len(rounds) > 1]
