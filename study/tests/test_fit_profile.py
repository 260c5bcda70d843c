from dataclasses import replace

import numpy as np
from fixtures import ground as made

from dav_gswt.photos.colmap_model import ColmapModel
from dav_gswt.reconstruction.coarse import StartViews, fit_coarse_field
from dav_gswt.reconstruction.fitting.plan import FitSettings
from dav_gswt_study import fit_profile

NONE = np.zeros((0, 3)), np.zeros((0, 3), np.float32)
TRACKS = np.zeros(0, int), np.zeros(0, int), np.zeros((0, 2))


def photo_set(tests):
    frame = replace(made.FRAME, kind="synthetic")
    return fit_profile.PhotoSet(frame, ColmapModel((), (), *NONE, *TRACKS), made.photos(4), {"test": tests}, 0.15)


def test_a_trial_tells_seconds_steps_and_quality_and_gives_the_field_that_a_fit_gives():
    photos = photo_set(made.photos(5)[4:])
    quality = FitSettings(fit_size=48, spacing=1.0, max_gaussians=5000, steps=12)
    found = fit_profile.profile_fit(photos, quality, every=5)
    assert [row["step"] for row in found.curve] == [5, 10, 12]
    assert all(row["seconds"] > 0 and row["psnr"] > 10 for row in found.curve)
    start = StartViews(photos.frame, photos.train, *NONE, photos.margin)
    alone = fit_coarse_field(start, quality, np.random.default_rng(0))
    np.testing.assert_array_equal(found.made.field.means, alone.field.means)
