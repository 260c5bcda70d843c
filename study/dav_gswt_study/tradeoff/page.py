"""study/docs/results/tradeoff.md: which settings are worth their time; every number comes from the table."""

from dav_gswt_study.experiments import PRESET
from dav_gswt_study.markdown import format_number, format_table
from dav_gswt_study.tradeoff.tables import UNITS

SAME = 0.02  # of the time: a setting that takes that much more or less is as fast
MIN_LOSS = {"dB": 0.005, "LPIPS": 0.00005, "grey levels": 0.005}  # a smaller loss is none: it would be written as 0
DIGITS = {"dB": 2, "LPIPS": 4, "grey levels": 2}
WHAT = {
    "views": "of PSNR of test views; seconds of all jobs to the bundle",
    "stills": "root mean square difference of the stills; seconds of the jobs on tiles",
    "seams": "how much more Seam-LPIPS over its floor; seconds of the jobs on tiles",
}


def describe_tradeoff(rows: list[dict], pareto: list[dict]) -> dict:
    """Values of the page's template.

    rows, pareto: as `tables.read_tradeoff` gives them; the base and a most accurate setting for every knob.
    """
    knobs = dict.fromkeys(row["knob"] for row in rows if row["knob"] != PRESET)
    return {
        "base": next(row for row in rows if row["base"]),
        "presets": format_table(*_tabulate_presets(pareto)),
        "verdicts": [describe_preset(row) for row in pareto if row["knob"] == PRESET],
        "knobs": [_describe_knob(knob, rows) for knob in knobs],
    }


def describe_preset(row: dict) -> str:
    """Whether no setting is as fast and better than a preset, and else by how much one is. row: of pareto.csv."""
    if row["front"]:
        return f"`{row['setting']}` is the best for its time: no other setting is as fast and better in PSNR."
    if row["behind"] > 0:
        rival = f"{row['rival_knob']} {row['rival_setting']}"
        return f"`{row['setting']}` is not the best for its time: {rival} is as fast and {row['behind']:.2f} dB better."
    return f"`{row['setting']}` is not the best for its time: another setting is as good and faster."


def describe_change(row: dict, best: dict) -> str:
    """What turning a knob from its most accurate setting to another brings and costs, as a sentence."""
    unit, own, other = UNITS[row["measure"]], row["own_seconds"], best["own_seconds"]
    said = f"`{row['knob']}` {row['setting']} instead of {best['setting']}: "
    if None in (own, other, row["loss"]):
        return f"{said}not measured."
    lost = row["loss"] if abs(row["loss"]) >= MIN_LOSS[unit] else 0.0
    amount = f"{abs(lost):.{DIGITS[unit]}f} {unit}"
    value = {1: f"costs {amount}", 0: "costs nothing", -1: f"is better by {amount}"}[(lost > 0) - (lost < 0)]
    joined = "but" if (own > other) == (lost < 0) and lost else "and"
    return f"{said}{_describe_pace(own / other)} {joined} {value}{_describe_bytes(row, best)}."


def _describe_bytes(row: dict, best: dict) -> str:
    if None in (row["bundle_mb"], best["bundle_mb"]) or abs(row["bundle_mb"] / best["bundle_mb"] - 1) <= SAME:
        return ""
    return f"; the bundle is {row['bundle_mb'] / best['bundle_mb']:.2f} times as large"


def _describe_pace(share: float) -> str:
    """share: of the most accurate setting's time."""
    if abs(share - 1) <= SAME:
        return "is as fast"
    return f"is {1 / share:.2f} times as fast" if share < 1 else f"takes {share:.2f} times as long"


def _tabulate_presets(pareto: list[dict]) -> tuple[list[str], list[list[str]]]:
    form = {"seconds": 0, "psnr": 2, "ssim": 3, "lpips": 3, "peak_mb": 0, "bundle_mb": 1}
    head = ["preset", "seconds", "PSNR (dB)", "SSIM", "LPIPS", "memory (MB)", "bundle (MB)"]
    head += ["best for its time", "in LPIPS"]
    said = {1: "yes", 0: "no", None: ""}
    found = []
    for row in (row for row in pareto if row["knob"] == PRESET):
        cells = [format_number(row[key], digits) for key, digits in form.items()]
        found.append([f"`{row['setting']}`", *cells, said[row["front"]], said[row["sharp"]]])
    return head, found


def _describe_knob(knob: str, rows: list[dict]) -> dict:
    mine = [row for row in rows if row["knob"] == knob]
    best, unit = next(row for row in mine if row["most"]), UNITS[mine[0]["measure"]]
    head = ["setting", "seconds", "PSNR (dB)", "LPIPS", f"loss ({unit})", "memory (MB)", "bundle (MB)"]
    form = {"own_seconds": 1, "psnr": 2, "lpips": 3, "loss": DIGITS[unit], "peak_mb": 0, "bundle_mb": 1}
    bold = {0: "{}", 1: "**{}**"}
    shown = [
        [bold[row["base"]].format(row["setting"]), *(format_number(row[key], digits) for key, digits in form.items())]
        for row in mine
    ]
    return {
        "name": knob,
        "what": WHAT[best["measure"]],
        "policy": best["policy"],
        "table": format_table(head, shown),
        "changes": [describe_change(row, best) for row in mine if not row["most"]],
    }
