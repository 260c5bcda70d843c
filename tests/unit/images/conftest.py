"""Weights of LPIPS: the published ones where they are at hand or can be fetched, and random ones of the same shapes."""

import pytest
from fixtures import lpips_arrays

from dav_gswt.errors import InputError
from dav_gswt.images import lpips_weights


@pytest.fixture(scope="session")
def real_weights(root, request, tmp_path_factory):
    """The published weights; fetched once and kept in pytest's cache where the rule did not fetch them."""
    kept = request.config.cache.mkdir("lpips") / "lpips_alexnet.safetensors"
    path = lpips_weights.found(root / lpips_weights.PATH) or lpips_weights.found(kept)
    if path is None:
        part = tmp_path_factory.mktemp("lpips") / kept.name
        try:
            lpips_weights.fetch(part)
        except InputError as error:
            pytest.skip(f"needs LPIPS's published weights: {error}")
        kept.write_bytes(part.read_bytes())
        path = part
    return lpips_weights.read(path)


@pytest.fixture(scope="session")
def random_weights():
    """Values of about the size that keeps features of unit size; heads not below 0, as LPIPS's are."""
    return lpips_arrays.random()
