"""Classes: the numbers shared with the page, bounds of cells, what reaches over a border, and painted places."""

import json
from pathlib import Path

import numpy as np
import pytest
from fixtures.land_covers import SIDE, gaussians, two_classes

from dav_gswt.bundle.land_cover import ClassesEntry, find_run_fault
from dav_gswt.files import parse_record
from dav_gswt.terrain.classes import LATTICE, Classes
from dav_gswt.terrain.heights import FlatSurface, Hills

GOLDEN = json.loads((Path(__file__).parents[2] / "golden" / "classes.json").read_text())["terrains"]


def classes_of(terrain) -> Classes:
    surface, entry = terrain["heights"], parse_record(terrain["classes"], ClassesEntry)
    heights = FlatSurface()
    if surface["kind"] == "hills":
        heights = Hills(*(surface[key] for key in ("height", "wavelength", "octaves", "salt")))
    return Classes(entry, terrain["materials"], terrain["side"], heights)


def discs_at(places, z=0.0):
    means = np.concatenate([places * SIDE, np.full((len(places), 1), z)], 1)
    return gaussians(means, [0.5] * 3, 0.1).means


@pytest.mark.parametrize("terrain", GOLDEN, ids=range(len(GOLDEN)))
def test_numbers_are_those_shared_with_the_page(terrain):
    classes = classes_of(terrain)
    for cell in terrain["cells"]:
        i, j, places = cell["i"], cell["j"], cell["places"]
        assert classes.materials_in(np.array([i]), np.array([j])).tolist() == [cell["materials"]]
        corner = classes.lattice_scores(np.array([LATTICE * i]), np.array([LATTICE * j]))[0]
        np.testing.assert_allclose(corner, cell["corner"], rtol=0, atol=1e-9)
        means = np.array([[place[axis] for axis in "xyz"] for place in places], np.float32)
        u, v = (means[:, axis].astype(float) / terrain["side"] for axis in (0, 1))
        scores = classes.scores_at(np.full(len(u), i), np.full(len(u), j), u, v)
        np.testing.assert_allclose(scores, [place["scores"] for place in places], rtol=0, atol=1e-9)
        jitter = classes.jitter_at(i, j, u, v)
        np.testing.assert_allclose(jitter, [place["jitter"] for place in places], rtol=0, atol=1e-9)
        kept = classes.keep(i, j, means, np.array([place["material"] for place in places]))
        assert kept.tolist() == [place["kept"] for place in places]


@pytest.mark.parametrize("amplitude", [0.0, 0.05])
def test_every_place_keeps_the_disc_of_a_material(amplitude):
    classes = Classes(two_classes(amplitude), 2, SIDE)
    rng = np.random.default_rng(1)
    for i, j in rng.integers(-1000, 1000, (8, 2)).tolist():
        discs = discs_at(rng.random((200, 2)))
        sand, grass = (classes.keep(i, j, discs, np.full(200, m)) for m in (0, 1))
        assert (sand | grass).all()
        assert not (sand & grass).any(), "flat discs of both at one place: a blend"


@pytest.mark.parametrize(
    "run, fault",
    [
        ([0, 0, 1], "not four numbers"),
        ([0, 0, 0, 0], "beyond the bounds"),
        ([2**23, 0, 1, 0], "beyond the bounds"),
        ([0, -(2**23), 1, 0], "beyond the bounds"),
        ([0, 1, 2**18, 0], "more than 262144 places"),
        ([0, 0, 1, 2], "not there"),
    ],
)
def test_runs_that_make_no_sense_are_named(run, fault):
    assert find_run_fault([[0, 0, 5, 1]], 2) is None and fault in find_run_fault([[0, 0, 5, 1], run], 2)
