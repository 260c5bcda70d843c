"""Weights of LPIPS: the published ones where they are at hand or can be fetched, and random ones of the same shapes."""

import made_up_weights
import pytest

from dav_gswt.errors import InputError
from dav_gswt.perceptual import weights


@pytest.fixture(scope="session")
def real_weights(root, request, tmp_path_factory):
    """The published weights; fetched once and kept in pytest's cache where the rule did not fetch them."""
    kept = request.config.cache.mkdir("lpips") / "lpips_alexnet.safetensors"
    path = weights.found(root / weights.PATH) or weights.found(kept)
    if path is None:
        part = tmp_path_factory.mktemp("lpips") / kept.name
        try:
            weights.fetch(part)
        except InputError as error:
            pytest.skip(f"needs LPIPS's published weights: {error}")
        kept.write_bytes(part.read_bytes())
        path = part
    return weights.read(path)


@pytest.fixture(scope="session")
def random_weights():
    """Values of about the size that keeps features of unit size; heads not below 0, as LPIPS's are."""
    return made_up_weights.random()
