from dataclasses import replace

import numpy as np
import pytest
from fixtures import ground as made

from dav_gswt.reconstruction import distractors


def test_a_line_that_one_photo_shows_does_not_count_and_nothing_else_is_lost():
    grid = made.grid(0.04)
    photos = made.photos(5, size=64)
    line = photos[2].image.copy()
    line[30:33, 10:54] = [1.0, 0.4, 0.0]
    found = distractors.mask_distractors(
        [*photos[:2], replace(photos[2], image=line), *photos[3:]], grid.centres, grid.spacing
    )
    lost = found[2].weight == 0
    assert lost[30:33, 14:50].mean() > 0.9
    lost[28:35] = False
    assert not lost.any()
    assert all(view.weight.all() for i, view in enumerate(found) if i != 2)


@pytest.mark.parametrize("side", [40, 80])
def test_a_shadow_over_much_of_a_photo_does_not_count(side, caplog):
    """Also where cells are several pixels wide: every pixel of the shadow belongs to one."""
    grid = made.grid(0.1)
    photos = made.photos(5, size=128)
    shaded = photos[2].image.copy()
    shaded[24 : 24 + side, 24 : 24 + side] *= 0.4
    views = [*photos[:2], replace(photos[2], image=shaded), *photos[3:]]
    lost = distractors.mask_distractors(views, grid.centres, grid.spacing)[2].weight == 0
    assert lost[28 : 20 + side, 28 : 20 + side].mean() > 0.9
    assert ("which do not count" in caplog.text) == (side == 80)


def test_where_all_photos_differ_none_is_at_fault():
    rng = np.random.default_rng(0)
    seen = rng.uniform(0, 1, (6, 500, 3)).astype(np.float32)
    assert distractors.find_disagreeing(seen).mean() < 0.01


def test_three_photos_have_no_majority():
    seen = np.full((3, 10, 3), 0.5, np.float32)
    seen[0] = 1.0
    assert not distractors.find_disagreeing(seen).any()
