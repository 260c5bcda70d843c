"""Directional coverage: what photos show of the ground, what further ones add, and what makes ground matter.

That is the field's error in the photos so far, or the prior's maps.
"""

from dataclasses import replace

import numpy as np
import pytest
from fixtures import ground as patch

from dav_gswt.field import write_field
from dav_gswt.geometry import cameras
from dav_gswt.geometry.scene_frame import write_scene_frame
from dav_gswt.images import image_files
from dav_gswt.photos.colmap_model import ColmapModel, write_colmap_model
from dav_gswt.photos.view_split import ViewSplit
from dav_gswt.raster import render
from dav_gswt.reconstruction import ground
from dav_gswt.views import coverage, selection
from dav_gswt.views.scores import PoseMaps, Scores, write_pose_maps
from dav_gswt.views.scoring import scoring_camera
from dav_gswt.views.uncertainty import Scales


@pytest.fixture(scope="module")
def cells():
    return coverage.GroundCells(patch.field(), patch.grid())


def look(x, y, z, at=(1.6, 1.6, 0.0), size=64):
    return cameras.pinhole([x, y, z], list(at), size, size, 40.0)


def gain(cells, taken, one, importance=None):
    return coverage.DirectionalCoverage(cells, cells.view(taken), cells.view([one]), importance).gain(0)


def test_gains_are_what_the_formula_says(cells):
    """K_gb and the logarithm, cell by cell."""
    taken, one = look(3.6, 1.6, 2.0), look(1.6, 3.0, 1.0)
    seen = cells.view([taken, one])
    importance = 1.0 + np.arange(len(cells)) % 3

    def shown(i, g, b):
        way = seen.centres[i] - cells.middle[g]
        cosine = way @ b / np.linalg.norm(way)
        return seen.pixels[i, g] * np.exp((cosine - 1) / (np.pi / 10) ** 2)

    total = 0.0
    for g in range(0, len(cells)):
        for elevation, count in coverage.BELTS:
            for azimuth in 2 * np.pi * np.arange(count) / count:
                up, level = np.sin(np.radians(elevation)), np.cos(np.radians(elevation))
                b = np.array([level * np.cos(azimuth), level * np.sin(azimuth), up])
                before = 1 + shown(0, g, b)
                total += importance[g] / importance.mean() * np.log((before + shown(1, g, b)) / before)
    assert gain(cells, [taken], one, importance) == pytest.approx(total)


def test_importance_has_any_scale_and_none_at_all_is_an_equal_one_and_what_shows_nothing_gains_nothing(cells):
    one, matters = look(2.7, 0.6, 1.0, (2.7, 0.5, 0.0)), np.where(cells.middle[:, 0] > 1.6, 5.0, 1.0)
    assert gain(cells, [], one, 1e-20 * matters) == pytest.approx(gain(cells, [], one, matters))
    assert gain(cells, [], one, 0 * matters) == pytest.approx(gain(cells, [], one))
    assert gain(cells, [], cameras.pinhole([0.0, 0.0, 2.0], [0.0, 0.0, 9.0], 64, 64, 40.0)) == 0
    for bad in (-1.0, np.nan):
        with pytest.raises(ValueError, match="importance"):
            gain(cells, [], one, np.full(coverage.CELLS**2, bad))


SPLIT = ViewSplit(("p0.png", "p2.png"), (), ())


def pool():
    return patch.pool(3, turn=2.0)


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    """A field that is darker than its photos, and more so in the east."""
    tmp_path = tmp_path_factory.mktemp("files")
    true = patch.field()
    east = np.where(true.means[:, 0] > 1.6, 0.6, 0.1).astype(np.float32)[:, None, None]
    write_field(replace(true, sh=true.sh - east), tmp_path / "field.ply")
    ground.write_ground(patch.grid(), tmp_path / "ground.exr")
    write_scene_frame(tmp_path / "ground.json", replace(patch.FRAME, kind="synthetic"))
    names = [pose.name for pose, _ in pool()]
    for pose, camera in pool():
        image_files.write_png(tmp_path / pose.name, np.clip(render(true, camera).colour, 0, 1))
    none = np.zeros(0, int)
    points = np.zeros((0, 3)), np.zeros((0, 3), np.float32), none, none, np.zeros((0, 2))
    (tmp_path / "sparse").mkdir()
    write_colmap_model(ColmapModel(tuple(names), tuple(c for _, c in pool()), *points), tmp_path / "sparse")
    known = np.where(true.means[:, 1] > 1.6, 0.8, 0.2).astype(np.float32)
    cells = coverage.GroundCells(true, patch.grid()).view([scoring_camera(camera) for _, camera in pool()]).pixels
    write_pose_maps(tmp_path / "maps.npz", PoseMaps(names, np.zeros((3, 4, 4), np.float32), None, cells), known)
    given = {name: tmp_path / f"{name}.{end}" for name, end in (("field", "ply"), ("ground", "exr"), ("maps", "npz"))}
    given |= {"frame": tmp_path / "ground.json", "images": tmp_path, "model": tmp_path / "sparse"}
    return given | {"captures": []}


def build(policy, files):
    scores = Scores([pose for pose, _ in pool()][::-1], {}, Scales({}))
    return selection.build_information_gain(policy, scores, pool(), [], SPLIT, files)


def test_gains_are_in_the_order_of_the_scores(cells, files):
    alone = [gain(cells, [], scoring_camera(camera)) for _, camera in pool()][::-1]
    assert build("coverage", files).gains() == alone and len(set(alone)) == 3
    assert (build("coverage", files).importance == 1).all()  # without a weight all cells count alike


def test_ground_that_is_shown_wrong_matters_more(cells, files):
    found, east = build("coverage-error", files).importance, cells.middle[:, 0] > 1.6
    assert found[east].mean() > 5 * found[~east].mean() > 0


def test_a_prior_counts_by_the_gaussians_over_a_cell(cells, files):
    found, north = build("coverage-w2", files).importance, cells.middle[:, 1] > 1.6
    assert found[north].mean() / found[~north].mean() == pytest.approx(4, rel=0.05)
    assert build("farthest", {}) is None
