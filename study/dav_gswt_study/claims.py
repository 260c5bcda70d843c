"""What the paper claims and what holds here, as one page; its figures are those of tables in study/docs/data."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from dav_gswt_study.csv_tables import read_table
from dav_gswt_study.markdown import write_page

PAGE = "study/docs/results/claims.md"
TEMPLATE = "study/report/claims.md"
DATA = "study/docs/data"
Row = dict
Reader = Callable[[str], list[Row]]
FEW = 2  # pairs, of which an interval is no more than their range
LEVEL = 0.05
CHOSEN = {"p_drop": 0.15, "lam": 0.1}  # by the paper
VERSIONED = ("sweep_k", "sweep_estimators", "seam_summary", "view_curves", "hundred_curves")  # tables with a column


@dataclass(frozen=True)
class Difference:
    """A mean difference. low, high: its interval, of FEW pairs and less their range; None where only means are known.

    p: of a paired t-test, corrected for how many were made (Holm); None where there was none.
    """

    mean: float
    low: float | None = None
    high: float | None = None
    pairs: int | None = None
    p: float | None = None

    def reverse(self) -> "Difference":
        """The second less the first instead."""
        low, high = (None if end is None else -end for end in (self.high, self.low))
        return replace(self, mean=-self.mean, low=low, high=high)

    def judge(self) -> str:
        """Whether the claim that the difference is above 0 holds, is not shown or is contradicted."""
        if self.low is None or self.high is None:
            return "by the means, " + ("yes" if self.mean > 0 else "no")
        if self.pairs is not None and self.pairs <= FEW:
            return f"in {'both' if self.low > 0 else 'neither' if self.high < 0 else 'one'} of {self.pairs} scenes"
        shown = self.p is None or self.p < LEVEL
        return "holds" if self.low > 0 and shown else "contradicted" if self.high < 0 and shown else "not shown"

    def format(self, unit: str = "") -> str:
        """Mean, interval and unit; without a unit with four digits, as differences of LPIPS need."""
        digits = 2 if unit else 4
        ends = "" if self.low is None else f" ({self.low:+.{digits}f}, {self.high:+.{digits}f})"
        test = "" if self.p is None else f", p = {self.p:.2f}"
        return f"{self.mean:+.{digits}f}{ends} {unit}".strip() + test


def describe_claims(root: Path) -> dict:
    """The values of the page's template, from the tables below a folder of the repository's shape.

    Raises: KeyError: a table lacks a row or column that a claim is judged by.
    """

    def rows(name: str) -> list[Row]:
        return read_table(root / DATA / f"{name}.csv")

    tables = (_describe_views, _describe_scores, _describe_settings, _describe_seams, _describe_frames)
    return {key: value for describe in tables for key, value in describe(rows).items()}


def _compare(row: Row, measure: str) -> Difference:
    """A measure's difference from the baseline, in a row of the ablation."""
    found = _read_difference(row, f"{measure}_difference", measure)
    p = row[f"{measure}_holm"]
    return replace(found, pairs=int(float(row[f"{measure}_units"])), p=float(p) if p else None)


def _read_difference(row: Row, mean: str, ends: str) -> Difference:
    low, high = (row[f"{ends}_{end}"] for end in ("low", "high"))
    return Difference(float(row[mean]), float(low) if low else None, float(high) if high else None)


def _describe_views(rows: Reader) -> dict:
    """Estimators and policies of the ablation, and the default of the view benchmark."""
    table = rows("ablation")
    budget = {row["variant"]: row for row in table if row["sweep"] == "budget"}
    compared = {row["variant"]: row for row in table if row["sweep"] == "estimators"}
    worth = rows("view_comparison")
    paired = [row for row in worth if row["policy"] == "coverage-error" and row["scene"] == "every"]
    default = {r["measure"]: Difference(float(r["mean"]), float(r["low"]), float(r["high"])) for r in paired}
    [real] = [r for r in worth if r["policy"] == "w2-lpips" and r["scene"] == "every" and r["measure"] == "psnr"]
    psnr = {variant: float(row["psnr"]) for variant, row in budget.items()}
    hundred = {r["policy"]: -float(r["gap"]) for r in rows("hundred_benchmark") if r["scene"] == "desert_100"}
    return {
        "version": ", ".join(sorted({row["version"] for table in VERSIONED for row in rows(table)})),
        "chosen": {variant: _compare(compared[variant], "psnr") for variant in ("w2", "grad-lpips", "single")},
        "photos": int(float(budget["w2-lpips"]["photos"])),
        "all_photos": int(float(budget["all"]["photos"])),
        "under_all": psnr["w2-lpips"] - psnr["all"],
        "hundred": hundred["w2-lpips"],
        "hundred_spread_out": hundred["farthest"],
        "random": Difference(psnr["w2-lpips"] - psnr["random"]),
        "spread_out": _compare(budget["w2-lpips"], "psnr"),
        "spread_out_real": Difference(float(real["mean"]), float(real["low"]), float(real["high"])),
        "starts": int(real["units"]),
        "default": default["psnr"],
        "default_worst": default["worst_psnr"],
    }


def _describe_scores(rows: Reader) -> dict:
    """How well the paper's u predicts errors."""
    table = [row for row in rows("calibration") if row["score"] == "u"]
    real = {row["scene"] for row in table if row["scene"].startswith("copr_dunes")}
    synthetic = [float(row["spearman"]) for row in table if row["scene"] not in real]
    covered = [100 * float(row["coverage"]) for row in table if row["coverage"]]
    return {
        "u_synthetic": _range(synthetic),
        "u_real": _range([float(row["spearman"]) for row in table if row["scene"] in real]),
        "u_scenes": len({row["scene"] for row in table} - real),
        "covered": _range(covered),
    }


def _describe_settings(rows: Reader) -> dict:
    """How much the paper's four settings change."""
    of: dict[str, dict[float, Row]] = {}
    for row in rows("sensitivity"):
        of.setdefault(row["setting"], {})[float(row["value"])] = row
    psnr = {name: [float(of[name][value]["psnr"]) for value in sorted(of[name])] for name in of}
    orders = [float(of["tau"][value]["orders"]) for value in sorted(of["tau"])]
    k_values = sorted(of["k"])[-2:]
    return {
        "k_values": [int(value) for value in k_values],
        "k_gain": psnr["k"][-1] - psnr["k"][-2],
        "spread": [max(psnr[name]) - min(psnr[name]) for name in ("p_drop", "lam", "tau")],
        "best": [max(sorted(of[name]), key=lambda value, name=name: float(of[name][value]["psnr"])) for name in CHOSEN],
        "chosen_by_paper": list(CHOSEN.values()),
        "tau_values": [min(of["tau"]), max(of["tau"])],
        "tau_orders": round(max(orders) / min(orders), 1),
    }


def _describe_seams(rows: Reader) -> dict:
    """Ways to cut, less cuts by colour, and the ablation of gamma."""
    less = [row for row in rows("seam_ablation") if row["measure"] == "seam_lpips"]
    every = [row for row in less if row["scene"] == "every"]
    cuts = {row["variant"]: _read_difference(row, "difference", "difference") for row in every}
    [ablated] = [r for r in rows("ablation") if (r["sweep"], r["variant"]) == ("seams", "semantic-nogamma")]
    gamma = _compare(ablated, "seam_lpips")
    return {"cuts": cuts, "seam_scenes": len({row["scene"] for row in less}) - 1, "gamma": gamma}


def _describe_frames(rows: Reader) -> dict:
    """Levels of detail, and the page's times at the first budget of Gaussians."""
    of: dict[str, dict[int, list[float]]] = {}
    for row in rows("lod"):
        of.setdefault(row["scene"], {}).setdefault(int(row["level"]), []).append(float(row["count"]))
    counts = [[np.mean(levels[level]) for level in sorted(levels)] for levels in of.values()]
    ratios = [before / after for each in counts for before, after in zip(each[:-1], each[1:], strict=True)]
    page = [row for row in rows("frames") if row["budget"] == rows("frames")[0]["budget"]]
    times = {name: _range([float(row[name]) for row in page]) for name in ("render_ms", "sort_ms", "update_ms")}
    return {
        "levels": [len(each) for each in counts],
        "ratio": float(np.exp(np.mean(np.log(ratios)))),
        "size": f"{page[0]['width']} x {page[0]['height']}",
        **times,
    }


def _range(values: list[float]) -> tuple[float, float]:
    return min(values), max(values)


if __name__ == "__main__":
    write_page(PAGE, TEMPLATE, describe_claims(Path()))
