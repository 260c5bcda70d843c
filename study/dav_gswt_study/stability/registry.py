"""All formulas that are compared with float64: what they are (`formulas.csv`) and the functions that compute them."""

from pathlib import Path

from dav_gswt_study import csv_tables
from dav_gswt_study.stability import ground, rasterizer, scores, terrain
from dav_gswt_study.stability.formula import Check, measure_error

DESCRIPTIONS = Path(__file__).with_name("formulas.csv")  # group, formula, source, range, type, tolerance_from
CHECKS: dict[str, Check] = {
    check.name: check for module in (scores, terrain, ground, rasterizer) for check in module.CHECKS
}


def read_descriptions() -> list[dict[str, str]]:
    """The rows of formulas.csv, a row a formula, in the order of the page."""
    return csv_tables.read_table(DESCRIPTIONS)


def measure_formula(about: dict[str, str]) -> dict:
    """A formula's row of the table. about: its row of formulas.csv.

    Columns `printed_` hold the worst error of the printed form by the same tolerance, and what it gives there.
    """
    check = CHECKS[about["formula"]]
    ours = measure_error(check, check.compute)
    printed = measure_error(check, check.printed) if check.printed else None
    return {name: about[name] for name in ("group", "formula", "source", "range", "type")} | {
        "finite": ours.finite,
        "absolute_error": ours.absolute,
        "relative_error": ours.relative,
        "worst_at": ours.label,
        "tolerance_relative": check.relative,
        "tolerance_absolute": check.absolute,
        "tolerance_from": about["tolerance_from"],
        "share_of_tolerance": ours.share,
        "printed_share_of_tolerance": printed and printed.share,
        "printed_at": printed and printed.label,
        "printed_gives": printed and f"{printed.computed:.9g}",
        "printed_right": printed and f"{printed.expected:.9g}",
    }
