import numpy as np
from fixtures import mixed_ground as made
from scipy.ndimage import gaussian_filter

from dav_gswt.materials import segmentation


def test_two_materials_are_told_apart():
    labels = segmentation.segment_ground(made.maps(shrubs=False).colour)
    assert (labels == made.true_materials()).mean() > 0.95  # a strip along the border may be a class of its own


def test_even_ground_is_one_class():
    assert segmentation.segment_ground(made.maps(mixed=False, shrubs=False).colour).max() == 0


def test_a_constant_picture_is_one_class():
    assert segmentation.segment_ground(np.full((64, 64, 3), 0.4)).max() == 0


def test_a_black_picture_is_one_class():
    assert segmentation.segment_ground(np.zeros((64, 64, 3))).max() == 0


def test_light_that_fades_over_the_ground_makes_no_second_class():
    colour = made.maps(mixed=False, shrubs=False).colour
    light = np.linspace(1.0, 0.55, len(colour))[None, :, None]
    assert segmentation.segment_ground(colour * light).max() == 0


def test_exposure_changes_no_label():
    colour = made.maps(shrubs=False).colour
    np.testing.assert_array_equal(segmentation.segment_ground(colour), segmentation.segment_ground(0.5 * colour))


def test_classes_are_numbered_by_their_share():
    labels = segmentation.segment_ground(made.maps().colour)
    counts = np.bincount(labels.ravel())
    assert (np.diff(counts) <= 0).all()


def test_grain_alone_can_make_a_class():
    """Rough and smooth ground of one mean colour."""
    rng = np.random.default_rng(0)
    grain = gaussian_filter(rng.normal(0, 1, (128, 128)), 0.7)
    amplitude = np.where(np.arange(128) < 64, 0.02, 0.5)[:, None]
    colour = np.clip(0.5 + (amplitude * grain)[..., None] * np.ones(3), 0, 1)
    labels = segmentation.segment_ground(colour)
    assert (labels[10:54] != labels[74:118]).mean() > 0.95


def test_the_same_picture_has_the_same_labels():
    colour = made.maps().colour
    np.testing.assert_array_equal(segmentation.segment_ground(colour), segmentation.segment_ground(colour.copy()))
