"""The page docs/research/results/auto.md: what `auto` chose, what fixed settings cost instead, and what was lost."""

from dav_gswt.files import read_json
from dav_gswt.provenance import describe_machine
from dav_gswt.study.markdown import format_number, format_table
from dav_gswt.study.statistics import subtract_or_none, sum_or_none
from dav_gswt.study.tradeoff.tables import mean_square, measure_cell

KEY = ("scene", "seed", "part", "processor", "cores")  # what tells rows apart
PARTS = {
    "fit": "Gaussians, degree and steps",
    "rounds": "when to ask for no more photos",
    "orders": "pre-sorted orders",
    "all": "all three",
}
FEWER = 1 / 3  # of the time at least is to be saved
MOST_DB, MOST_LPIPS = 0.1, 0.002  # at most is to be lost
WORK = ("recon_s", "levels_s", "cut_s", "bundle_s")


def tabulate_auto(cells: list[dict]) -> list[dict]:
    """A row for each scene and part; of a scene the cell `base`, with fixed settings, comes before the others.

    saved: share of the fixed settings' seconds (jobs from the start views to the bundle, but the taking of photos).
    loss_db, loss_lpips: of the test views. target: 1 where at least a third of the time was saved for at most 0.1 dB
    and 0.002 LPIPS, empty where one of them is not known. difference: root mean square of the stills, in grey levels.
    cells: as `tables.tabulate_settings` has them, with `part` and the paths `fits`, the coarse fit's first.
    """
    found, base = [], {}
    for cell in cells:
        row = cell | measure_cell(cell)
        if cell["part"] == "base":
            base = row
        else:
            found.append(_row(row, base))
    return found


def describe_choices(cell: dict) -> str:
    """What was chosen, in words."""
    coarse, *later = (read_json(path) for path in cell["fits"])
    degree, steps = (later or [coarse])[-1]["degree"], " + ".join(str(fit["steps"]) for fit in later)
    said = {
        "fit": f"{cell['gaussians']:.0f} Gaussians, degree {degree}, {coarse['steps']} steps, then {steps or 'none'}",
        "rounds": f"{cell['photos']:.0f} photos",
        "orders": f"all orders for {cell['deep']:.0%} of tiles, {cell['levels']:.0f} levels",
    }
    return "; ".join(said.values()) if cell["part"] == "all" else said[cell["part"]]


def _row(mine: dict, base: dict) -> dict:
    seconds, fixed = (sum_or_none(cell[key] for key in WORK) for cell in (mine, base))
    lost = {
        "loss_db": subtract_or_none(base["psnr"], mine["psnr"]),
        "loss_lpips": subtract_or_none(mine["lpips"], base["lpips"]),
    }
    found = {key: mine[key] for key in ("scene", "seed", "part")} | {"chosen": describe_choices(mine)}
    found |= {"preset": mine["preset"], "fixed_quality": base["preset"]}
    saved = None if seconds is None or fixed is None else 1 - seconds / fixed
    found |= {"seconds": seconds, "fixed_seconds": fixed, "saved": saved}
    found |= lost | {"difference": 255 * mean_square(mine["stills"], base["stills"]) ** 0.5}
    for key in ("photos", "gaussians", "levels", "bundle_mb", "peak_mb"):
        found |= {key: mine[key], f"fixed_{key}": base[key]}
    found |= {"target": check_target(saved, **lost)}
    return found | {"version": mine["version"], "renderer": mine["renderer"]} | describe_machine()


def check_target(saved: float | None, loss_db: float | None, loss_lpips: float | None) -> int | None:
    """Whether enough time was saved for little enough loss; None where that is not known."""
    if saved is None or loss_db is None or loss_lpips is None:
        return None
    return int(saved >= FEWER and loss_db <= MOST_DB and loss_lpips <= MOST_LPIPS)


def format_auto(rows: list[dict]) -> str:
    """The page. rows: as `tables.read_tradeoff` gives them."""
    first = rows[0]
    parts = [
        "# Only what the scene requires",
        "Made by `snakemake docs/research/results/auto.md` from `docs/research/data/auto.csv`; "
        "do not edit. What `auto` chose instead of fixed "
        f"settings (preset `{first['fixed_quality']}`, all rounds, all pre-sorted orders), "
        f"seed {first['seed']:.0f}, on {first['cores']:.0f} cores of {first['processor']}: seconds of whole "
        "jobs from the start views to the bundle, without the taking of photos. Wanted is at least a third less time "
        f"for at most {MOST_DB:g} dB and {MOST_LPIPS:g} LPIPS. How many candidates are scored is not chosen by itself.",
        _format_outcome(rows),
        *(part for scene in dict.fromkeys(row["scene"] for row in rows) for part in _format_scene(scene, rows)),
    ]
    return "\n\n".join(part.rstrip("\n") for part in parts if part) + "\n"


def _format_outcome(rows: list[dict]) -> str:
    known = [row["target"] for row in rows if row["part"] == "all" and row["target"] is not None]
    return f"{sum(known):.0f} of {len(known)} scenes reach that with all three." if known else ""


def _format_scene(scene: str, rows: list[dict]) -> list[str]:
    head = ["by itself", "chosen", "seconds", "fixed", "saved", "lost (dB)", "lost (LPIPS)"]
    head += ["stills differ (grey levels)", "bundle (MB)", "fixed", "reached"]
    shown = []
    for row in (row for row in rows if row["scene"] == scene):
        cells = [
            PARTS[row["part"]],
            row["chosen"],
            format_number(row["seconds"], 0),
            format_number(row["fixed_seconds"], 0),
        ]
        cells += ["" if row["saved"] is None else f"{row['saved']:.0%}", format_number(row["loss_db"], 2)]
        cells += [format_number(row["loss_lpips"], 4), format_number(row["difference"], 2)]
        cells += [format_number(row["bundle_mb"], 1), format_number(row["fixed_bundle_mb"], 1)]
        shown.append([*cells, {None: "", 0: "no", 1: "yes"}[row["target"]]])
    return [f"## {scene}", format_table(head, shown)]
