"""The tables of study/docs/results/materials.md, from the tables of study/docs/data."""

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

from dav_gswt.materials.store import read_report
from dav_gswt_study.csv_tables import read_table
from dav_gswt_study.markdown import format_table

ACCURACY = ("iou_sand", "iou_meadow", "iou_boulders", "iou_path")
REPETITION = ("brightness", "landmarks", "busyness", "mean_tile", "next")


def tabulate_verdicts(folders: Mapping[str, Path | str]) -> list[dict]:
    """The verdict on each scene and on each of its materials. folders: of materials, by scene."""
    rows = []
    for scene, folder in folders.items():
        found = read_report(folder)
        whole = {"scene": scene, "of": "all", "share": 1 - found.excluded, "objects": len(found.objects)}
        rows.append(whole | vars(found.verdict))
        for number, each in enumerate(found.materials):
            own = sum(thing.material == number for thing in found.objects)
            rows.append({"scene": scene, "of": each.name, "share": each.share, "objects": own} | vars(each.verdict))
    return rows


def describe_materials(tables: Mapping[str, Path | str]) -> dict[str, str]:
    """What the page's template is filled with: Markdown by the name of each table.

    tables: the files `materials`, `lattice` and `verdicts`.
    """
    made = {"materials": _describe_accuracy, "lattice": _describe_repetition, "verdicts": _describe_verdict}
    heads = {
        "materials": ["scene", "sand", "meadow", "boulders", "path", "**mean IoU**", "true objects", "found", "wrong"]
        + ["precision", "recall", "**F1**"],
        "lattice": ["scene", "materials", "objects", "excess of brightness", "excess of landmarks", "busyness"]
        + ["mean tile", "next tile"],
        "verdicts": ["scene", "material", "share of the ground", "objects", "verdict"],
    }
    return {name: format_table(heads[name], map(describe, read_table(tables[name]))) for name, describe in made.items()}


def _describe_accuracy(row: dict[str, str]) -> Sequence[str]:
    ious, rates = _round(row, ACCURACY, 2), _round(row, ("precision", "recall", "f1"), 2)
    return [row["scene"], *ious, *_round(row, ["mean_iou"]), row["objects"], row["found"], row["wrong"], *rates]


def _describe_repetition(row: dict[str, str]) -> Sequence[str]:
    alone = "" if row["of"] == "all" else f", {row['of']} alone"
    return [row["scene"] + alone, row["materials"], row["objects"], *_round(row, REPETITION)]


def _describe_verdict(row: dict[str, str]) -> Sequence[str]:
    return [row["scene"], row["of"], *_round(row, ["share"], 2), row["objects"], f"{row['grade']}: {row['reason']}"]


def _round(row: dict[str, str], names: Iterable[str], digits: int = 3) -> list[str]:
    return [f"{float(row[name]):.{digits}f}" for name in names]
