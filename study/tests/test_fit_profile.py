import numpy as np
from fixtures import ground as made

from dav_gswt.photos.colmap_model import ColmapModel
from dav_gswt.reconstruction.fitting.plan import FitSettings
from dav_gswt_study import fit_profile


def test_a_trial_tells_seconds_steps_and_quality():
    none, tracks = (np.zeros((0, 3)), np.zeros((0, 3), np.float32)), (np.zeros(0, int),) * 2
    model = ColmapModel((), (), *none, *tracks, np.zeros((0, 2)))
    photos = fit_profile.PhotoSet(made.FRAME, model, made.photos(4), made.photos(5)[4:])
    quality = FitSettings(fit_size=48, spacing=1.0, max_gaussians=5000, steps=12)
    found = fit_profile.profile_fit(photos, quality, every=5)
    assert [row["step"] for row in found] == [5, 10, 12]
    assert all(row["seconds"] > 0 and row["psnr"] > 10 for row in found)
    assert fit_profile.find_time_to(found, 10.0) == found[0]["seconds"]
    assert fit_profile.find_time_to(found, 99.0) is None
