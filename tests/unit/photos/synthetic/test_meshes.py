"""Stones, shrubs and tufts as meshes."""

import numpy as np
import pytest
import trimesh

from dav_gswt.photos.synthetic import meshes


def volume(vertices, faces):
    """Enclosed volume, positive where faces are counter-clockwise from outside (divergence theorem)."""
    a, b, c = (vertices[faces[:, i]].astype(float) for i in range(3))
    return (np.cross(a, b) * c).sum() / 6


def test_a_stone_is_closed_outside_out_and_about_1_across():
    for seed in range(10):
        stone = meshes.make_stone(np.random.default_rng(seed), 3)
        spans = np.ptp(stone.vertices, axis=0)
        assert 0.6 < spans[0] <= 1.07 and spans[2] < spans[0]
        assert 0 < volume(stone.vertices, stone.faces) < np.prod(spans)
        assert stone.colours.min() > 0 and stone.colours.max() < 1


@pytest.mark.parametrize("grow", [meshes.make_shrub, meshes.make_tuft])
def test_a_plant_stands_on_its_root_about_1_high_in_reflectances(grow):
    for seed in range(4):
        plant = grow(np.random.default_rng(seed))
        assert 0.6 < plant.vertices[:, 2].max() < 1.6
        assert plant.vertices[:, 2].min() > -0.4  # blades and twigs may droop below the root on a slope
        assert np.isfinite(plant.vertices).all()
        assert plant.colours.min() > 0 and plant.colours.max() < 1
        assert plant.faces.min() == 0 and plant.faces.max() == len(plant.vertices) - 1


@pytest.mark.parametrize("grow", [meshes.make_shrub, meshes.make_tuft])
def test_every_face_of_a_plant_has_one_colour(grow):
    plant = grow(np.random.default_rng(1))
    assert np.ptp(plant.colours[plant.faces], axis=1).max() == 0


def test_a_mesh_is_scaled_turned_and_moved():
    one = meshes.Mesh(np.array([[1, 0, 0]], np.float32), np.zeros((0, 3), int), np.ones((1, 3), np.float32))
    assert meshes.transform_mesh(one, (1, 2, 3), 2.0, np.pi / 2).vertices[0] == pytest.approx([1, 4, 3])


def test_merged_meshes_keep_their_faces():
    icosphere = trimesh.creation.icosphere(subdivisions=0)
    sphere, faces = np.array(icosphere.vertices), np.array(icosphere.faces)
    one = meshes.Mesh(sphere.astype(np.float32), faces, np.ones((12, 3), np.float32))
    two = meshes.merge_meshes([one, meshes.transform_mesh(one, (5, 0, 0), 1.0, 0.0)])
    assert volume(two.vertices, two.faces) == pytest.approx(2 * volume(sphere, faces), rel=1e-5)  # float32 positions
