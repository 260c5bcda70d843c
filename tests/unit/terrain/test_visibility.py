"""Visible cells: conservative culling, draw order, weights of levels, budget."""

import json
from pathlib import Path

import numpy as np
import pytest
from fixtures.terrains import SIDE, walking

from dav_gswt.bundle import orders
from dav_gswt.terrain import draw_order, visibility
from dav_gswt.terrain.draw_order import crossfade_opacity, level_weights

FOLDER = Path(__file__).parents[2] / "golden"
GOLDEN = json.loads((FOLDER / "draw_order.json").read_text())
WEIGHTS = json.loads((FOLDER / "weights.json").read_text())


def met_by_rays(surface, camera, reach):
    """Cells whose ground a ray through some pixel meets within reach: the slow way, in small steps along each."""
    origin, step = (a.reshape(-1, 3) for a in camera.rays())
    step = step / np.linalg.norm(step, axis=1, keepdims=True)
    t = np.arange(0.05, reach, 0.02)
    met = set()
    for o, s in zip(origin, step, strict=True):
        at = o + t[:, None] * s
        under = np.flatnonzero(at[:, 2] < surface.at(at[:, 0], at[:, 1])[0])
        if len(under):
            met.add(tuple(np.floor(at[under[0], :2] / SIDE).astype(int).tolist()))
    return met


@pytest.mark.parametrize(
    "surface, pitch, height",
    [("hilly", 12.0, 3.0), ("hilly", -10.0, 1.0), ("terrain", 60.0, 1.0), ("terrain", 89.0, 9.0)],
)
def test_what_the_camera_sees_is_there(request, surface, pitch, height):
    shown = request.getfixturevalue(surface)
    camera = walking(shown, pitch, height, size=(16, 9))
    cells = visibility.visible_cells(shown, camera)
    assert met_by_rays(shown.heights, camera, shown.reach * SIDE) <= set(
        zip(cells.i.tolist(), cells.j.tolist(), strict=True)
    )


def test_levels_come_nearer_until_a_picture_fits_its_budget(terrain):
    camera = walking(terrain)
    cells = visibility.visible_cells(terrain, camera)
    whole = int(visibility.count_gaussians(terrain, cells).sum())
    assert visibility.coarsen_to_budget(terrain, camera, whole) is terrain
    coarser = visibility.coarsen_to_budget(terrain, camera, int(0.9 * whole))
    count, factor = visibility.count_gaussians(coarser, cells).sum(), coarser.switches[0] / terrain.switches[0]
    assert 0.8 * whole < count <= 0.9 * whole and 0 < factor < 1
    np.testing.assert_allclose(coarser.bands, np.multiply(terrain.bands, factor))


def window(west, south, columns, rows):
    i, j = np.meshgrid(west + np.arange(columns), south + np.arange(rows))
    return i.ravel(), j.ravel()


@pytest.mark.parametrize("entry", GOLDEN["cells"], ids=lambda e: str(e["eye"]))
def test_cells_stand_in_the_order_shared_with_the_page(entry):
    i, j = window(*(entry[key] for key in ("west", "south", "columns", "rows")))
    sequence = draw_order.sort_cells(i, j, tuple(entry["eye"]))
    assert np.stack([i, j], 1)[sequence].tolist() == entry["order"]
    assert draw_order.in_near_block(i, j, tuple(entry["eye"]))[sequence].tolist() == entry["close"]


def test_orders_are_those_shared_with_the_page():
    along = np.array(GOLDEN["along"])
    np.testing.assert_allclose(along, orders.DirectionRings().directions(), atol=1e-15)
    for entry in GOLDEN["orders"]:
        to, slope = np.array(entry["to"], float), np.array(entry["slope"], float)
        assert draw_order.nearest_order(along, entry["kept"], to, slope) == entry["position"]


def test_weights_are_those_shared_with_the_page():
    for entry in (each for each in WEIGHTS["levels"] if not each["smooth"]):
        switches = [np.inf if s is None else s for s in entry["switches"]]
        found = level_weights(np.array([entry["distance"]]), switches, entry["bands"])[:, 0]
        np.testing.assert_allclose(found, entry["weights"], rtol=0, atol=1e-12, err_msg=str(entry))


def test_opacities_are_those_shared_with_the_page():
    opacity, weight, drawn = (
        np.array([e[key] for e in WEIGHTS["opacities"]]) for key in ("opacity", "weight", "drawn")
    )
    np.testing.assert_allclose(crossfade_opacity(opacity, weight), drawn, rtol=1e-12, atol=0)
