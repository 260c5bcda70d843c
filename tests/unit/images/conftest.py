"""Weights of LPIPS: the published ones, which the set-up installs, and random ones of the same shapes."""

import pytest
from fixtures import lpips_arrays

from dav_gswt.images import lpips_weights


@pytest.fixture(scope="session")
def real_weights():
    """The published weights."""
    return lpips_weights.read(lpips_weights.locate_weights("installed"))


@pytest.fixture(scope="session")
def random_weights():
    """Values of about the size that keeps features of unit size; heads not below 0, as LPIPS's are."""
    return lpips_arrays.random()
