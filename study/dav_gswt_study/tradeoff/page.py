"""study/docs/results/tradeoff.md: which settings are worth their time; every number comes from the table."""

from dav_gswt_study.experiments import PRESET
from dav_gswt_study.markdown import format_number, format_table
from dav_gswt_study.tradeoff.tables import UNITS

DIGITS = {"dB": 2, "LPIPS": 4, "grey levels": 2}


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
    """Whether nothing is as fast and better than a preset, and else what is, and by how much. row: of pareto.csv."""
    if row["front"]:
        return f"`{row['setting']}` has the best PSNR for its time: nothing else is as fast and better in PSNR."
    worse = f"`{row['setting']}` does not have the best PSNR for its time"
    if row["behind"] > 0:
        rival = f"`{row['rival_knob']}` {row['rival_setting']}"
        return f"{worse}: {rival} is as fast and {row['behind']:.2f} dB better."
    return f"{worse}: something else is as good and faster."


def _tabulate_presets(pareto: list[dict]) -> tuple[list[str], list[list[str]]]:
    form = {"seconds": 0, "psnr": 2, "ssim": 3, "lpips": 3, "peak_mb": 0, "bundle_mb": 1}
    head = ["preset", "seconds", "PSNR (dB)", "SSIM", "LPIPS", "peak memory (MB)", "bundle (MB)"]
    head += ["best PSNR for its time", "best LPIPS for its time"]
    said = {1: "yes", 0: "no", None: ""}
    found = []
    for row in (row for row in pareto if row["knob"] == PRESET):
        cells = [format_number(row[key], digits) for key, digits in form.items()]
        found.append([f"`{row['setting']}`", *cells, said[row["front"]], said[row["sharp"]]])
    return head, found


def _describe_knob(knob: str, rows: list[dict]) -> dict:
    mine = [row for row in rows if row["knob"] == knob]
    unit = UNITS[mine[0]["measure"]]
    head = ["value", "seconds", "PSNR (dB)", "LPIPS", f"loss ({unit})", "peak memory (MB)", "bundle (MB)"]
    form = {"own_seconds": 1, "psnr": 2, "lpips": 3, "loss": DIGITS[unit], "peak_mb": 0, "bundle_mb": 1}
    bold = {0: "{}", 1: "**{}**"}
    shown = [
        [bold[row["base"]].format(row["setting"]), *(format_number(row[key], digits) for key, digits in form.items())]
        for row in mine
    ]
    return {
        "name": knob,
        "policy": mine[0]["policy"],
        "table": format_table(head, shown),
    }
