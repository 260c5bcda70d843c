"""The figure of two test views from round to round: which are shown, what is compared, and on what scale."""

from dataclasses import replace

import numpy as np
import pytest
from fixtures import ground as patch
from fixtures.frames import scene_frame

from dav_gswt.errors import InputError
from dav_gswt.images import image_files, metrics
from dav_gswt.reconstruction import evaluation
from dav_gswt.reconstruction.observation import mask_to_ground
from dav_gswt.study.views import evolution

KEYS = ("psnr", "psnr_colour_corrected")
SPOILT = (0.02, 0.1, 0.05)  # deviations of the photos' noise


def rows(**psnr):
    return {"test_views": [{"view": name, "psnr": p, "psnr_colour_corrected": -p} for name, p in psnr.items()]}


def spoilt():
    """Photos that differ from the ground by noise, and are darker."""
    rng, found = np.random.default_rng(0), []
    for view, noise in zip(patch.photos(), SPOILT, strict=True):
        image = np.clip(view.image + noise * rng.normal(size=view.image.shape), 0, 1)
        found.append(replace(view, image=(0.8 * image).astype(np.float32)))
    return found


def round_of(number, wrong):
    """A round whose field is off by a share of its colour."""
    made = patch.field()
    made, views = replace(made, sh=made.sh * np.float32(1 + wrong)), mask_to_ground(spoilt(), patch.grid())
    return evolution.Round(number, made, patch.grid(), evaluation.evaluate_field(made, views) | {"photos": 3 + number})


def cell():
    return [round_of(0, 0.5), round_of(1, 0.2), round_of(3, 0.0)]


def errors(figure):
    """Maps of error: pictures of one channel."""
    return [shown for axes in figure.axes for shown in axes.get_images() if shown.get_array().ndim == 2]


def texts(figure):
    return [text.get_text() for axes in figure.axes for text in (*axes.texts, axes.xaxis.label)]


@pytest.mark.parametrize(
    "views, names",
    [
        (dict(a=30.0, b=20.0, c=25.0, d=22.0, e=40.0), ["b", "c"]),
        (dict(a=30.0, b=20.0, c=25.0, d=22.0), ["b", "c"]),
        (dict(a=30.0, b=20.0), ["b", "a"]),
        (dict(a=30.0), ["a"]),
    ],
)
def test_the_worst_and_the_median_view_are_shown(views, names):
    assert list(evolution.choose_test_views(rows(**views), "psnr")) == names


def test_the_choice_goes_by_the_measure_and_equal_pictures_are_the_best():
    found = rows(a=30.0, b=20.0, c=25.0)
    assert list(evolution.choose_test_views(found, "psnr_colour_corrected")) == ["a", "c"]
    found["test_views"][1]["psnr"] = None
    assert list(evolution.choose_test_views(found, "psnr")) == ["c", "a"]
    assert evolution.psnr_key(scene_frame(kind="photos")) == KEYS[1]
    assert evolution.psnr_key(scene_frame(kind="synthetic")) == KEYS[0]


def test_without_a_test_view_there_is_nothing_to_show():
    with pytest.raises(InputError, match="round 0: has no test view"):
        evolution.choose_test_views({"test_views": []}, "psnr")


@pytest.mark.parametrize("key", KEYS)
def test_errors_are_those_that_the_metrics_were_measured_by(key):
    one, view = round_of(1, 0.2), spoilt()[1]
    found = evolution.render_view(one, view, key)
    counts = mask_to_ground([view], patch.grid())[0].weight > 0
    assert 0.1 < counts.mean() < 0.99
    np.testing.assert_array_equal(np.isfinite(found.error), counts)
    np.testing.assert_allclose(found.error[counts], np.abs(found.picture - view.image).mean(-1)[counts], atol=1e-6)
    assert metrics.psnr(found.picture, view.image, counts.astype(float)) == pytest.approx(found.row[key], abs=1e-4)


def test_what_does_not_count_is_greyed_out():
    picture = np.zeros((2, 2, 3), np.float32)
    picture[..., 0] = 1
    counts = np.array([[True, False], [False, True]])
    found = evolution.fade_masked(picture, counts)
    np.testing.assert_array_equal(found[counts], picture[counts])
    assert np.abs(found[~counts] - evolution.GREY).max() <= 1 - evolution.FADED + 1e-6
    figure = evolution.draw_figure(evolution.build_strips(cell(), spoilt(), "psnr"), cell(), "psnr")
    for shown in errors(figure):
        np.testing.assert_allclose(shown.cmap(np.nan)[:3], evolution.GREY)
        assert np.isnan(np.ma.filled(shown.get_array(), np.nan)).any()


def test_the_same_views_are_shown_in_all_rounds_on_one_scale():
    rounds = cell()
    found = evolution.build_strips(rounds, spoilt(), "psnr")
    assert [strip.name for strip in found] == list(evolution.choose_test_views(rounds[0].metrics, "psnr"))
    assert all(len(strip.looks) == len(rounds) for strip in found)
    figure = evolution.draw_figure(found, rounds, "psnr")
    maps = errors(figure)
    assert len(maps) == 6 and {shown.get_clim() for shown in maps} == {(0, evolution.error_limit(found))}
    for shown, one in zip(maps, [one for strip in found for one in strip.looks], strict=True):
        np.testing.assert_array_equal(np.ma.filled(shown.get_array(), np.nan), one.error)
    every = np.concatenate([one.error.ravel() for strip in found for one in strip.looks])
    assert evolution.error_limit(found) == pytest.approx(np.nanquantile(every, evolution.HIGHEST))
    pictures = [shown.get_array() for axes in figure.axes for shown in axes.get_images()]
    assert len(pictures) == 2 * (1 + 3 + 3)


def test_under_each_column_stand_its_photos_and_measures():
    rounds = cell()
    figure = evolution.draw_figure(evolution.build_strips(rounds, spoilt(), KEYS[1]), rounds, KEYS[1])
    said = texts(figure)
    assert [text for text in said if text in ("photo", *(f"round {t}" for t in range(5)))] == [
        "photo", "round 0", "round 1", "round 3",
    ]  # fmt: skip
    for one in rounds:
        mean = f"{one.metrics[KEYS[1]]:.1f} dB, SSIM {one.metrics['ssim']:.3f}"
        assert f"{3 + one.number} photos\n{mean}" in said
        worst = min(one.metrics["test_views"], key=lambda row: row["ssim"])
        assert any(f"SSIM {worst['ssim']:.3f}" in text for text in said)
    assert "mean of 3 test views,\nPSNR colour-corrected" in said


def test_a_round_that_lacks_a_view_is_named():
    rounds = cell()
    rounds[1].metrics["test_views"] = rounds[1].metrics["test_views"][:1]
    with pytest.raises(InputError, match="metrics.json of round 1: lacks the test view photo_"):
        evolution.build_strips(rounds, spoilt(), "psnr")


def test_the_figure_is_wide_enough_to_read_and_the_same_each_time(tmp_path):
    rounds = cell()
    found = evolution.build_strips(rounds, spoilt(), "psnr")
    for name in ("a.png", "b.png"):
        evolution.write_figure(tmp_path / name, found, rounds, "psnr")
    assert (tmp_path / "a.png").read_bytes() == (tmp_path / "b.png").read_bytes()
    assert (
        image_files.read_size(tmp_path / "a.png")[0] >= 1000 and image_files.read_photo(tmp_path / "a.png").std() > 0.05
    )
    assert [p.name for p in sorted(tmp_path.iterdir())] == ["a.png", "b.png"]
