"""The exemplar as the photos show it from above."""

import numpy as np
import pytest
from fixtures import photos as synth
from fixtures.frames import scene_frame

from dav_gswt.photos.folder import write_photo_folder
from dav_gswt.photos.report import mosaic
from dav_gswt.photos.report.facts import collect_facts

FRAME = scene_frame(
    kind="photos", unit="flying height", flying_height=1.0, exemplar=(-0.5, -0.5, 1.0), extent=(-1.0, -1.0, 1.0, 1.0)
)


def paint(camera):
    """What a camera sees of a plane that is red in the west, green in the north-east and blue in the south-east."""
    origin, way = camera.rays()
    t = origin[..., 2] / np.maximum(-way[..., 2], 1e-9)
    x, y = origin[..., 0] + t * way[..., 0], origin[..., 1] + t * way[..., 1]
    colours = np.where((y > 0)[..., None], [0.1, 0.8, 0.1], [0.1, 0.1, 0.8])
    return np.where((x < 0)[..., None], [0.8, 0.1, 0.1], colours)


@pytest.fixture
def made(tmp_path):
    sparse = synth.model(synth.flight(3, 4), synth.plain(600, 0.9, np.random.default_rng(1)))

    def make(sparse=sparse):
        pictures = ((name, paint(camera)) for name, camera in zip(sparse.names, sparse.cameras, strict=True))
        write_photo_folder(tmp_path / "photos", sparse, pictures, FRAME, None, None)
        return tmp_path / "photos", collect_facts(tmp_path / "photos", "scene")

    return make


def test_places_keep_their_colours(made):
    folder, found = made()
    picture = mosaic.make_mosaic(folder / "images", found)
    quarter, m = mosaic.CELLS // 4, mosaic.CELLS
    for row, column, channel in (
        (quarter, quarter, 0),
        (3 * quarter, quarter, 0),
        (3 * quarter, m - quarter, 1),
        (quarter, m - quarter, 2),
    ):
        assert picture[row, column].argmax() == channel


def test_kinds_are_counted(made):
    folder, found = made()
    kinds = mosaic.find_kinds(folder / "images", found, lambda colour: (colour[..., 0] < 0.5).astype(int))
    assert kinds.shares == pytest.approx((0.5, 0.5), abs=0.05)
