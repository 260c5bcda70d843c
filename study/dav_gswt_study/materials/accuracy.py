"""How well materials and objects were found: mean IoU and F1 against the true labels of a synthetic scene."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Bool, Float, Int
from numpy import ndarray as Array
from scipy.optimize import linear_sum_assignment

from dav_gswt.images import image_files
from dav_gswt.materials.objects import BORDER, SMALLEST
from dav_gswt_study.materials.true_labels import LabelMap

LEAST_IOU = 0.4  # of an object with its true footprint, above which it counts as found


@dataclass(frozen=True)
class FoundLabels:
    """materials.exr: what was found in each cell of the exemplar, row 0 in the south, and the cells' middles.

    material: the nearest one. kind: its material, or a strip from the number of materials on. object: numbers from 1;
    0: none. excluded: cells that are shown nowhere.
    """

    material: Int[Array, "m m"]
    kind: Int[Array, "m m"]
    object: Int[Array, "m m"]
    excluded: Bool[Array, "m m"]
    x: Float[Array, "m"]
    y: Float[Array, "m"]


def read_found_labels(folder: Path | str) -> FoundLabels:
    """Read the label map of a materials folder. Raises: InputError: not readable."""
    channels, header = image_files.read_exr(Path(folder, "materials.exr"))
    material, kind, objects, excluded = (
        np.rint(channels[name][::-1]).astype(int) for name in ("material", "kind", "object", "excluded")
    )
    west, south, spacing = (float(header[name]) for name in ("west", "south", "spacing"))
    middles = (np.arange(len(kind)) + 0.5) * spacing
    return FoundLabels(material, kind, objects, excluded > 0, west + middles, south + middles)


def sample_labels(truth: LabelMap, found: FoundLabels) -> tuple[Int[Array, "m m"], Int[Array, "m m"]]:
    """True material and object in the middle of each found cell; 0 beyond the map."""
    rows, columns = truth.material.shape
    extent = truth.extent
    row = np.floor((found.y - extent.south) / (extent.north - extent.south) * rows).astype(int)
    column = np.floor((found.x - extent.west) / (extent.east - extent.west) * columns).astype(int)
    inside = ((row >= 0) & (row < rows))[:, None] & ((column >= 0) & (column < columns))
    pick = np.ix_(np.clip(row, 0, rows - 1), np.clip(column, 0, columns - 1))
    return np.where(inside, truth.material[pick], 0), np.where(inside, truth.object[pick], 0)


def score_materials(truth: LabelMap, found: FoundLabels) -> dict[str, float]:
    """IoU of each true material with the found one that is assigned to it (one to one, the best sum), and their mean.

    Cells below true objects do not count. A material that none is assigned to has an IoU of 0.
    """
    material, thing = sample_labels(truth, found)
    counted = (material > 0) & (thing == 0)
    names = {name: number for name, number in truth.materials.items() if (material[counted] == number).any()}
    shares = np.zeros((len(names), int(found.kind.max()) + 1))
    for i, number in enumerate(names.values()):
        for j in range(shares.shape[1]):
            true, own = (material == number) & counted, (found.kind == j) & counted
            shares[i, j] = (true & own).sum() / max((true | own).sum(), 1)
    ious = dict.fromkeys(names, 0.0)
    for i, j in zip(*linear_sum_assignment(-shares), strict=True):
        ious[list(names)[i]] = float(shares[i, j])
    return {f"iou_{name}": value for name, value in ious.items()} | {"mean_iou": float(np.mean(list(ious.values())))}


def score_objects(truth: LabelMap, found: FoundLabels) -> dict[str, float | int]:
    """Precision, recall and F1 of objects: a found one is right if its footprint has LEAST_IOU with a true one's.

    True objects that are cut off by the exemplar's border or too small to be taken out do not count, and what was found
    on them is neither right nor wrong.
    """
    _, thing = sample_labels(truth, found)
    m, wanted, ignored = len(thing), {}, np.zeros(thing.shape, bool)
    for number in np.unique(thing[thing > 0]).tolist():
        own = thing == number
        rows, columns = np.nonzero(own)
        cut = min(rows.min(), columns.min()) < BORDER or max(rows.max(), columns.max()) >= m - BORDER
        wide = max(np.ptp(rows), np.ptp(columns)) + 1 >= SMALLEST * m
        if wide and not cut:
            wanted[number] = own
        else:
            ignored |= own
    matched, wrong = set(), 0
    for number in range(1, int(found.object.max()) + 1):
        own = found.object == number
        best = max(wanted, key=lambda k: _iou(own, wanted[k]), default=None)
        if best is not None and _iou(own, wanted[best]) >= LEAST_IOU:
            matched.add(best)
        elif not (own & ignored).any():
            wrong += 1
    precision = len(matched) / max(len(matched) + wrong, 1)
    recall = len(matched) / max(len(wanted), 1)
    f1 = 2 * precision * recall / max(precision + recall, 1e-12)
    return {"objects": len(wanted), "found": len(matched), "wrong": wrong, "precision": precision, "recall": recall} | {
        "f1": f1
    }


def _iou(one: Bool[Array, "m m"], two: Bool[Array, "m m"]) -> float:
    return float((one & two).sum() / max((one | two).sum(), 1))
