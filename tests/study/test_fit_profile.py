from dataclasses import replace

import numpy as np
from fixtures import ground as made

from dav_gswt.field import concatenate_fields
from dav_gswt.photos.colmap_model import ColmapModel
from dav_gswt.reconstruction.coarse import StartViews, fit_coarse_field
from dav_gswt.reconstruction.fit_settings import CoarseSettings, UpdateSettings
from dav_gswt.reconstruction.objects import make_blobs
from dav_gswt.study import fit_profile, refits

NONE = np.zeros((0, 3)), np.zeros((0, 3), np.float32)
TRACKS = np.zeros(0, int), np.zeros(0, int), np.zeros((0, 2))


def photo_set(tests):
    frame = replace(made.FRAME, kind="synthetic")
    return fit_profile.PhotoSet(frame, ColmapModel((), (), *NONE, *TRACKS), made.photos(4), {"test": tests}, 0.15)


def test_a_trial_tells_seconds_steps_and_quality_and_gives_the_field_that_a_fit_gives():
    photos = photo_set(made.photos(5)[4:])
    quality = CoarseSettings(size=48, spacing=1.0, max_gaussians=5000, steps=12)
    found = fit_profile.profile_fit(photos, quality, every=5)
    assert [row["step"] for row in found.curve] == [5, 10, 12]
    assert all(row["seconds"] > 0 and row["psnr"] > 10 for row in found.curve)
    start = StartViews(photos.frame, photos.train, *NONE, photos.margin)
    alone = fit_coarse_field(start, quality, np.random.default_rng(0))
    np.testing.assert_array_equal(found.made.field.means, alone.field.means)
    assert fit_profile.measure_test_groups(photos, found.made) == {"test": found.curve[-1]["psnr"]}


def test_haze_is_counted_and_what_stands_low_is_not():
    haze = []
    for height in (0.3, 2.0):
        blob = make_blobs(np.array([[1.6, 1.6, height]]), np.full((1, 3), 0.5), np.full(1, 0.3))
        field = concatenate_fields([made.field(), blob])
        haze.append(fit_profile.measure_haze(field, made.grid(), photo_set(made.photos(1))))
    assert haze[0] == 0 and haze[1] > 0.01


COARSE = CoarseSettings(size=48, spacing=1.0, max_gaussians=5000, steps=8)
UPDATE = UpdateSettings(size=48, max_gaussians=5000, steps_per_photo=8)


def test_all_ways_to_the_same_photos_take_the_same_steps_and_gain_quality(monkeypatch):
    views, taken, refine = made.photos(8), [], refits.refine_field
    photos = refits.RefitPhotos(replace(made.FRAME, kind="synthetic"), views[:7], views[7:], lambda n: NONE, 0.15)

    def counted(given, *rest):
        taken.append(len(given.new))
        return refine(given, *rest)

    monkeypatch.setattr(refits, "refine_field", counted)
    settings = refits.RefitSettings(COARSE, UPDATE, start=3, weights=None)
    first, once, *rounds = refits.compare_refits(photos, settings, [4, 3], [1.0, 0.3], [0])
    assert taken == [4, 4, 3, 1, 3, 1]
    assert (first["photos"], first["steps"]) == (3, 8)
    assert [(row["photos"], row["steps"]) for row in (once, *rounds)] == [(7, 8 + 4 * 8)] * 5
    assert [(row["photos_a_round"], row["first_rate"]) for row in rounds] == [(4, 1.0), (4, 0.3), (3, 1.0), (3, 0.3)]
    assert once["psnr"] > first["psnr"] + 1 and rounds[0]["psnr"] != rounds[1]["psnr"]
