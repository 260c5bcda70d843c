"""Tile sets laid out: who lies beside whom, where cuts run, which patch is where."""

import numpy as np
import pytest

from dav_gswt.errors import InputError
from dav_gswt.files import read_json, write_json
from dav_gswt.inspect import tile_scenes as seen
from dav_gswt.inspect.options import ViewOptions
from dav_gswt.tiles import store
from dav_gswt.tiles.layout import edge_colours


@pytest.fixture(scope="module")
def cut(tree):
    return store.read_tiles(tree.tiles / "tiles", tree.tiles / "seams.json")


def test_neighbours_meet_at_edges_of_one_colour():
    at = {tuple(np.rint(corner[:2]).astype(int)): tile for tile, corner in seen.place_tiles(16, 1.0)}
    assert sorted(at.values()) == list(range(16))
    for (x, y), tile in at.items():
        west, south = at[(x - 1) % 4, y], at[x, (y - 1) % 4]
        assert edge_colours(west)[2] == edge_colours(tile)[0] and edge_colours(south)[1] == edge_colours(tile)[3]


def test_a_cut_is_a_ribbon_wherever_labels_change_just_above_the_ground(cut):
    labels = cut.labels[5]
    layer = seen.make_cuts(cut, 5, 0)
    assert len(layer.cells) == (labels[1:] != labels[:-1]).sum() + (labels[:, 1:] != labels[:, :-1]).sum() > 0
    middle = layer.points.reshape(-1, 4, 3).mean(1)
    cells = middle[:, :2] / cut.spacing
    upright = np.abs(cells[:, 0] - np.rint(cells[:, 0])) < 1e-3  # on a border that runs north
    across = np.where(upright[:, None], [0.5, 0.0], [0.0, 0.5])
    one, other = (np.floor(cells + sign * across).astype(int) for sign in (-1, 1))
    assert (labels[one[:, 1], one[:, 0]] != labels[other[:, 1], other[:, 0]]).all()
    ground = seen.compute_heights(cut.fields[0][5], len(labels), cut.spacing)
    lift = middle[:, 2] - np.maximum(ground[one[:, 1], one[:, 0]], ground[other[:, 1], other[:, 0]])
    np.testing.assert_allclose(lift, seen.CUT_LIFT * cut.spacing, atol=1e-5)


def test_gaussians_have_the_patch_of_their_cell(cut):
    some = cut.fields[0][3]
    found = seen.find_patches(some, cut, 3)
    inside = (some.means[:, :2] >= 0).all(1) & (some.means[:, :2] < cut.side).all(1)
    for i in np.flatnonzero(inside)[::97]:
        x, y = (some.means[i, :2] / cut.spacing).astype(int)
        assert found[i] == cut.labels[3][y, x]


def test_tiles_that_are_not_what_seams_json_says_are_refused(tree, tmp_path):
    told = read_json(tree.tiles / "seams.json")
    (tmp_path / "tiles").symlink_to(tree.tiles / "tiles")
    write_json(tmp_path / "seams.json", told | {"side": 99.0})
    with pytest.raises(InputError, match="their maps are not"):
        seen.build_tiles(tmp_path, ViewOptions())
