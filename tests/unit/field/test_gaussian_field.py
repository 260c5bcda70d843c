from dataclasses import replace

import numpy as np
import pytest
from fixtures.random_field import random_field

from dav_gswt.field import concatenate_fields, rgb_to_sh


def test_concatenating_and_indexing_keep_the_order():
    one, two = random_field(3, seed=1), random_field(2, seed=2)
    both = concatenate_fields([one, two])
    assert np.array_equal(both[3:].means, two.means) and np.array_equal(both[np.array([0, 4])].sh[1], two.sh[1])


def test_a_colour_of_half_has_no_coefficients_and_full_ones_are_known():
    assert rgb_to_sh(np.float32([[0, 0.5, 1]]))[0, 0] == pytest.approx([-1.7724539, 0, 1.7724539])  # sqrt(pi)


def test_base_colours_invert_rgb_to_sh():
    colours = np.float32([[0, 0.5, 1]])
    assert replace(random_field(1), sh=rgb_to_sh(colours)).base_colours == pytest.approx(colours, abs=1e-6)


@pytest.mark.parametrize("degree", [0, 1, 2, 3])
def test_the_degree_follows_from_the_number_of_coefficients(degree):
    assert random_field(degree=degree).sh_degree == degree
