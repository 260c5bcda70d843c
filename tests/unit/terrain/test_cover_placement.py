"""Terrains of several materials with objects on them: whole ground, counts, order, and objects on the surface."""

from dataclasses import replace

import numpy as np
import pytest
from fixtures.land_covers import GRASS, SAND, SIDE, cover_content
from fixtures.terrains import HILLS, SKY, walking

from dav_gswt.bundle.build import BundleOptions, write_bundle
from dav_gswt.terrain import endless, placement, stills, visibility

MAGENTA = [1.0, 0.0, 1.0]


@pytest.fixture(scope="module")
def cover(tmp_path_factory):
    content = cover_content()
    info = write_bundle(content, tmp_path_factory.mktemp("cover") / "b", BundleOptions(tau=0.5, salt=7), {})
    fields = [content.tile_fields(level) for level in range(content.levels)]
    objects = [each.fields for each in content.objects]
    return replace(endless.terrain_from_fields(fields, info, {"kind": "flat"}, objects), reach=10)


@pytest.fixture(scope="module")
def bare(cover):
    """The same terrain without objects."""
    return replace(cover, scatter=None)


@pytest.fixture(scope="module")
def seen(cover):
    """Visible cells of a walker, and the objects by the cell that they are drawn with."""
    camera = walking(cover)
    cells = visibility.visible_cells(cover, camera)
    return camera.centre, cells, placement.group_by_cell(cover, cells, camera.centre)


def test_a_picture_shows_both_materials_without_a_gap_and_the_objects(cover, bare):
    camera = stills.shot_camera(stills.Shot("down", (0.3, 0.2), 14.0, 90.0, 90.0), cover, 1.0, 64, 64)
    terrains = replace(bare, classes=None), bare, cover  # the first: its first material's tiles
    alone, image, full = (stills.render_view(terrain, camera, SKY, MAGENTA) for terrain in terrains)
    # magenta would raise blue above green
    assert (image[..., 2] - image[..., 1]).max() <= (alone[..., 2] - alone[..., 1]).max() + 0.02
    redder = image[..., 0] > image[..., 1]
    assert 0.2 < redder.mean() < 0.8
    assert image[redder].mean(0) == pytest.approx(SAND, abs=0.08)
    assert image[~redder].mean(0) == pytest.approx(GRASS, abs=0.08)
    changed = np.abs(image - full).max(-1) > 0.05
    assert 0.001 < changed.mean() < 0.3
    assert full[changed].mean(0) == pytest.approx([0.2, 0.35, 0.15], abs=0.1)


def test_an_object_is_drawn_with_the_last_of_the_cells_that_it_touches(cover, seen):
    eye, cells, things = seen
    moved = 0
    for k, some in things.items():
        radius = cover.scatter.objects[0].radius * some.size / SIDE
        for n in range(len(some)):
            x, y = some.i[n] + some.u[n], some.j[n] + some.v[n]
            touched = (np.abs(cells.i + 0.5 - x) < 0.5 + radius[n]) & (np.abs(cells.j + 0.5 - y) < 0.5 + radius[n])
            last = int(np.flatnonzero(touched)[-1])  # cells come back to front
            steps = np.abs(cells.i - np.floor(eye[0] / SIDE)) + np.abs(cells.j - np.floor(eye[1] / SIDE))
            assert steps[k] == steps[last]
            moved += (cells.i[k], cells.j[k]) != (some.i[n], some.j[n])
    assert moved > 0


def test_an_object_stands_on_the_surface(cover, seen):
    hilly = replace(cover, heights=HILLS)
    eye, cells, things = seen
    k, some = next(iter(things.items()))
    cell = cells[k : k + 1]
    flat, raised = (placement.place_cell(terrain, cell, eye, some)[0] for terrain in (cover, hilly))
    tall = flat.means[:, 2] + eye[2] > 0.3
    assert tall.any()
    height, _ = HILLS.at(flat.means[tall, 0].astype(float) + eye[0], flat.means[tall, 1].astype(float) + eye[1])
    assert raised.means[tall, 2] - flat.means[tall, 2] == pytest.approx(height, abs=1e-3)
