import numpy as np
from fixtures import ground as made

from dav_gswt.reconstruction import top_view


def test_a_map_from_above_has_the_south_in_its_first_row():
    grid = made.grid()
    found = top_view.render_top_view(made.field(grid), grid)
    true = made.look(*grid.centres[:, :2].T).reshape(*grid.shape, 3)
    inner = np.s_[3:-3, 3:-3]
    # coplanar discs are blended by their index, which moves the picture by a part of a cell
    assert np.abs(found.colour[inner] - true[inner]).mean() < 0.02
    assert np.abs(found.colour[::-1][inner] - true[inner]).mean() > 0.05
    np.testing.assert_allclose(found.height[inner], 0, atol=2e-3)
