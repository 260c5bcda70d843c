"""Small synthetic land, and golden numbers of what is grown from a seed."""

import json
import os
from pathlib import Path

import numpy as np
import pytest

from dav_gswt.photos.synthetic import flowers, grass, land, meadow, oasis, planet
from dav_gswt.photos.synthetic import scene as synthetic
from dav_gswt.photos.synthetic.meshes import Mesh

GOLDEN = Path(__file__).with_name("golden.json")
RINGS = {meadow: {"NEAR": 3.0, "FAR": 6.0}, oasis: {"NEAR": 3.0, "FAR": 6.0}, flowers: {"NEAR": 3.0}}
RINGS[grass] = {"NEAR": 3.0, "MIDDLE": 4.0, "FAR": 6.0, "REACH": 5.0}


@pytest.fixture(scope="module")
def small_land():
    """Land of few texels on a coarse grid, with nothing far away: quick to make, and otherwise the same.

    Returns a list to which the height function of each land is appended.
    """
    heights = []

    def make_coarse_ground(height):
        heights.append(height)
        outer = 7.0 + np.cumsum(0.1 * 1.25 ** np.arange(1, 28))
        axis = np.concatenate([-outer[::-1], np.linspace(-7, 7, 141), outer])
        x, y = np.meshgrid(axis, axis)
        index = np.arange(x.size).reshape(x.shape)
        a, b, c, d = index[:-1, :-1].ravel(), index[:-1, 1:].ravel(), index[1:, 1:].ravel(), index[1:, :-1].ravel()
        vertices = np.stack([x, y, height(x, y)], -1).reshape(-1, 3).astype(np.float32)
        return Mesh(vertices, np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)]), None, smooth=True)

    with pytest.MonkeyPatch.context() as patch:
        for family in synthetic.FAMILIES.values():
            patch.setattr(family, "TEXELS", 128)
            for ring, end in RINGS.get(family, {}).items():
                patch.setattr(family, ring, end)
        patch.setattr(flowers, "TURFS", ((0.5, 0.0, 3.0, 30, 2),))
        patch.setattr(flowers, "SWATHES", ((1.4, 3.0, 5.0, 4, 1),))
        patch.setattr(planet, "SORTS", tuple((*sort, 6.0, 3, min(fine, 2)) for *sort, _, _, fine in planet.SORTS))
        patch.setattr(land, "STONE_SQUARE", 4.0)
        patch.setattr(land, "make_ground_mesh", make_coarse_ground)
        synthetic.load_scene.cache_clear()
        yield heights
    synthetic.load_scene.cache_clear()


@pytest.fixture
def golden():
    """Compares meshes, arrays and numbers with the sums that golden.json has by a name.

    With WRITE_GOLDEN=1 in the environment the file is written instead.
    """

    def compare(name, *parts):
        numbers = [number for part in parts for number in sum_up(part)]
        known = json.loads(GOLDEN.read_text(encoding="utf-8")) if GOLDEN.exists() else {}
        if os.environ.get("WRITE_GOLDEN"):
            known[name] = [float(f"{number:.7g}") for number in numbers]
            rows = ",\n".join(f"{json.dumps(key)}: {json.dumps(known[key])}" for key in sorted(known))
            GOLDEN.write_text(f"{{\n{rows}\n}}\n", encoding="utf-8")
        assert numbers == pytest.approx(known[name], rel=1e-4, abs=1e-6), name

    return compare


def sum_up(part) -> list[float]:
    """The number of rows, and the weighted means of the columns, in which every value and its place counts."""
    if isinstance(part, Mesh):
        arrays = part.vertices, part.faces, part.colours
        return [number for array in arrays if array is not None for number in sum_up(array)]
    rows = np.asarray(part, float)
    rows = rows.reshape(len(rows), np.prod(rows.shape[1:], dtype=int))
    weights = np.linspace(0.5, 1.5, len(rows))
    return [float(len(rows)), *(weights @ rows / max(len(rows), 1)).tolist()]
