from dataclasses import replace

import numpy as np
from fixtures import ground as made

from dav_gswt.field import concatenate_fields
from dav_gswt.geometry.scene_frame import write_scene_frame
from dav_gswt.images import image_files
from dav_gswt.photos.colmap_model import ColmapModel, write_colmap_model
from dav_gswt.reconstruction.coarse import StartViews, fit_coarse_field
from dav_gswt.reconstruction.fit_settings import CoarseSettings
from dav_gswt.reconstruction.objects import make_blobs
from dav_gswt.study import fit_profile

QUALITY = CoarseSettings(size=48, spacing=1.0, max_gaussians=5000, steps=12)


def photo_set(tests):
    none = np.zeros(0, int)
    empty = ColmapModel((), (), np.zeros((0, 3)), np.zeros((0, 3), np.float32), none, none, np.zeros((0, 2)))
    frame = replace(made.FRAME, kind="synthetic")
    return fit_profile.PhotoSet(frame, empty, made.photos(4), {"test": tests})


def test_the_sixth_photo_and_every_tenth_after_it_are_for_testing(tmp_path):
    photos = made.photos(17)
    (tmp_path / "images").mkdir()
    names = tuple(f"{chr(97 + i)}.png" for i in range(17))
    for name, photo in zip(names, photos, strict=True):
        image_files.write_png(tmp_path / "images" / name, photo.image)
    none = np.zeros(0, int)
    cameras = tuple(photo.camera for photo in photos)
    (tmp_path / "sparse").mkdir()
    write_colmap_model(
        ColmapModel(names, cameras, np.zeros((0, 3)), np.zeros((0, 3), np.float32), none, none, np.zeros((0, 2))),
        tmp_path / "sparse",
    )
    write_scene_frame(tmp_path / "ground.json", made.FRAME)
    given = fit_profile.read_photo_set(tmp_path, 48)
    assert [v.name for v in given.tests["test"]] == ["f.png", "p.png"]
    assert len(given.train) == 15


def test_a_trial_tells_seconds_steps_and_quality_and_gives_the_field_that_a_fit_gives():
    photos = photo_set(made.photos(5)[4:])
    found = fit_profile.profile_fit(replace(photos, margin=0.15), QUALITY, every=5)
    assert [row["step"] for row in found.curve] == [5, 10, 12]
    assert all(row["seconds"] > 0 and row["psnr"] > 10 for row in found.curve)
    none = np.zeros((0, 3)), np.zeros((0, 3), np.float32)
    alone = fit_coarse_field(StartViews(photos.frame, photos.train, *none), QUALITY, np.random.default_rng(0))
    np.testing.assert_array_equal(found.made.field.means, alone.field.means)
    assert set(fit_profile.measure_test_groups(photos, found.made)) == {"test"}


def test_when_a_quality_was_first_reached():
    curve = [{"seconds": float(s), "psnr_colour_corrected": p} for s, p in [(1, 30.0), (2, 33.5), (3, 32.9)]]
    assert fit_profile.find_time_to(curve, 33.0) == 2.0
    assert fit_profile.find_time_to(curve, 34.0) is None


def test_haze_is_counted_and_what_stands_low_is_not():
    photos = photo_set(made.photos(1))
    low = make_blobs(np.array([[1.6, 1.6, 0.3]]), np.full((1, 3), 0.5), np.full(1, 0.3))
    high = make_blobs(np.array([[1.6, 1.6, 2.0]]), np.full((1, 3), 0.5), np.full(1, 0.3))
    assert fit_profile.measure_haze(concatenate_fields([made.field(), low]), made.grid(), photos) == 0
    assert fit_profile.measure_haze(concatenate_fields([made.field(), high]), made.grid(), photos) > 0.01
