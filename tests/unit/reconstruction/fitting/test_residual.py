import numpy as np
import pytest
from fixtures import ground as made

from dav_gswt.raster import Rasterizer, to_raster_arrays
from dav_gswt.reconstruction.fitting.residual import Residual


def noted(shares):
    """What a residual says after pictures that are wrong by .1 in this share of their columns."""
    residual, drawn = Residual(), Rasterizer()
    for view, share in zip(made.photos(len(shares)), shares, strict=True):
        drawn.forward(**to_raster_arrays(made.field()), camera=view.camera)
        weight = np.zeros_like(view.weight)
        weight[:, : round(share * weight.shape[1])] = 1
        residual.add(drawn, np.full_like(view.image, 0.1), weight)
    return residual


def test_errors_of_all_photos_add_up_and_count_once_for_each_gaussian():
    once, twice = noted([1.0]), noted([1.0, 1.0])
    assert once.error_per_photo == pytest.approx(once.errors.sum(), rel=1e-5)
    assert twice.errors.sum() > 1.8 * once.errors.sum()
    assert twice.error_per_photo == pytest.approx(once.error_per_photo, rel=0.1)
    assert twice.photos.max() == 2


def test_pixels_that_do_not_count_say_nothing():
    assert noted([0.0]).error_per_photo == 0
    half, whole = noted([0.5]), noted([1.0])
    assert 0 < half.errors.sum() < whole.errors.sum()
    assert (half.photos <= whole.photos).all()


def test_nothing_noted_is_no_error():
    assert Residual().error_per_photo == 0 and len(Residual().errors) == 0
