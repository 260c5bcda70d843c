from dataclasses import replace

import numpy as np
from fixtures import ground as made

from dav_gswt.reconstruction import distractors


def test_a_line_that_one_photo_shows_does_not_count_and_nothing_else_is_lost():
    grid = made.grid(0.04)
    photos = made.photos(5, size=64)
    line = photos[2].image.copy()
    line[30:33, 10:54] = [1.0, 0.4, 0.0]
    found = distractors.mask_distractors([*photos[:2], replace(photos[2], image=line), *photos[3:]], grid.centres)
    lost = found[2].weight == 0
    assert lost[30:33, 14:50].mean() > 0.9
    lost[28:35] = False
    assert not lost.any()
    assert all(view.weight.all() for i, view in enumerate(found) if i != 2)


def test_where_all_photos_differ_none_is_at_fault():
    rng = np.random.default_rng(0)
    seen = rng.uniform(0, 1, (6, 500, 3)).astype(np.float32)
    assert distractors.find_disagreeing(seen).mean() < 0.01


def test_three_photos_have_no_majority():
    seen = np.full((3, 10, 3), 0.5, np.float32)
    seen[0] = 1.0
    assert not distractors.find_disagreeing(seen).any()
