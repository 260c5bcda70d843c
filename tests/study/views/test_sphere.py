"""The figure of the candidates over a scene: where they are drawn, in what colours, and what is marked."""

import numpy as np
import pytest
from fixtures.frames import scene_frame

from dav_gswt.errors import InputError
from dav_gswt.geometry import camera_layouts, cameras
from dav_gswt.geometry.poses import Pose
from dav_gswt.images import image_files
from dav_gswt.study.views import sphere
from dav_gswt.views import score_colours
from dav_gswt.views.scores import Scores
from dav_gswt.views.uncertainty import Scales

FRAME = scene_frame(exemplar=(1.0, 2.0, 2.0))
MIDDLE = np.array([2.0, 3.0, 0.0])


def scored(count=60, high=1.0, **terms):
    poses = [Pose(f"p{i}", *place) for i, place in enumerate(camera_layouts.hemisphere(count, 30.0, 5.0))]
    terms = {"coverage": np.linspace(0.0, high, count)} | terms
    return Scores(poses, terms, Scales({name: 0.5 for name in terms}), np.zeros(count, int))


def chosen_poses(*numbers):
    return [Pose(f"p{i}", 45.0, 0.0, 5.0) for i in numbers]


def photo(*eye):
    return cameras.pinhole(MIDDLE + eye, MIDDLE, 8, 8, 40.0)


def round_of(number=1, chosen=(5, 40, 2), photos=((0.0, 0.0, 5.0), (0.0, -3.0, 3.0)), high=1.0, count=60):
    taken = [photo(*eye) for eye in photos]
    return sphere.build_round(number, scored(count, high), chosen_poses(*chosen), taken, FRAME, 0.0)


def test_poses_lie_where_they_are_seen_from_above():
    poses = [Pose("", 90.0, 200.0, 5.0), Pose("", 0.0, 0.0, 5.0), Pose("", 30.0, 90.0, 9.0)]
    np.testing.assert_allclose(
        sphere.project_poses(poses), [[np.radians(200), 0], [0, 1], [np.pi / 2, 0.5**0.5]], atol=1e-7
    )


def test_candidates_even_over_the_hemisphere_are_even_over_the_figure():
    poses = [Pose("", *place) for place in camera_layouts.hemisphere(50, 0.0, 5.0)]
    np.testing.assert_allclose(sphere.project_poses(poses)[:, 1] ** 2, (np.arange(50) + 0.5) / 50)


def test_a_round_holds_the_photos_before_it_and_its_choice_in_order():
    one = round_of()
    assert one.chosen == [5, 40, 2] and one.candidates.shape == (60, 2)
    np.testing.assert_allclose(one.taken[0, 1], 0, atol=1e-7)
    np.testing.assert_allclose(one.taken[1] % (2 * np.pi), [1.5 * np.pi, np.sqrt(1 - np.sin(np.pi / 4))])
    assert 30 < one.lowest < 31  # of the candidates: the photos stand higher
    assert round_of(photos=((4.0, 0.0, 1.0),)).lowest == pytest.approx(np.degrees(np.arctan2(1, 4)))
    with pytest.raises(InputError, match="poses.json of round 3: p77 is not among"):
        round_of(3, chosen=(1, 77))


def test_colours_are_on_one_scale_and_stars_stand_on_the_chosen_in_order():
    rounds = [round_of(), round_of(2, chosen=(7, 8, 50), high=0.5)]
    figure = sphere.draw_figure(rounds, "uncertainty")
    panels = figure.axes[:2]
    scales = {dots.norm for axes in panels for dots in axes.collections if dots.get_array() is not None}
    assert len(scales) == 1 and figure.axes[2].get_xlabel() == "uncertainty"
    (scale,) = scales
    every = np.concatenate([one.values for one in rounds])
    assert (scale.vmin, scale.vmax) == (0, pytest.approx(np.quantile(every, score_colours.HIGHEST)))
    for axes, one in zip(panels, rounds, strict=True):
        dots, photos, stars = axes.collections
        np.testing.assert_array_equal(dots.get_offsets(), one.candidates)
        np.testing.assert_array_equal(dots.get_array(), one.values)
        np.testing.assert_array_equal(photos.get_offsets(), one.taken)
        assert photos.get_facecolors().size == 0  # hollow
        np.testing.assert_array_equal(stars.get_offsets(), one.candidates[one.chosen])
        assert [text.get_text() for text in axes.texts] == ["1", "2", "3"]
        for text, (angle, radius) in zip(axes.texts, one.candidates[one.chosen], strict=True):
            (a, r), edge = text.get_position(), 0.5**0.5
            off = np.hypot(r * np.cos(a) - radius * np.cos(angle), r * np.sin(a) - radius * np.sin(angle))
            assert off == pytest.approx(sphere.APART * edge)
    assert [axes.get_title() for axes in panels] == [f"round {t}: 3 of 60 poses, after 2 photos" for t in (1, 2)]


def test_numbers_stand_where_nothing_else_does():
    apart = sphere.APART
    lone = sphere.place_labels(np.array([[0.5, 0.0], [0.0, 0.0], [1.0, 0.0]]), np.zeros((0, 2)), 1.0)
    np.testing.assert_allclose(lone[:2], [[0.5 + apart, 0.0], [apart, 0.0]])
    assert np.linalg.norm(lone[2]) <= 1  # not outside
    stars = apart * np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]])
    taken = apart * np.array([[-1.0, 0.0], [0.0, -1.0]])
    marks = np.concatenate([stars, taken, sphere.place_labels(stars, taken, 1.0)])
    between = np.linalg.norm(marks[:, None] - marks, axis=-1)[~np.eye(len(marks), dtype=bool)]
    # the sides of an octagon around the first star: any other place of its number is another's
    assert between.min() >= 2 * apart * np.sin(np.pi / 8) - 1e-9


def test_many_chosen_are_not_numbered_and_none_is_said():
    many = sphere.draw_figure([round_of(chosen=range(30))], "uncertainty").axes[0]
    assert len(many.texts) == 0 and len(many.collections[-1].get_offsets()) == 30
    none = sphere.draw_figure([round_of(chosen=(), photos=((0.0, 0.0, 5.0),))], "uncertainty").axes[0]
    assert none.get_title() == "round 1: no pose, after 1 photo" and not none.texts


def test_candidates_all_alike_or_none_at_all_are_drawn(tmp_path):
    alike = [round_of(high=0.0), sphere.build_round(2, scored(0), chosen_poses(), [photo(0.0, 0.0, 5.0)], FRAME, 0.0)]
    sphere.write_figure(tmp_path / "a.png", alike, "uncertainty")
    assert image_files.read_photo(tmp_path / "a.png").std() > 0.05


def test_the_figure_is_wide_enough_to_read_and_the_same_each_time(tmp_path):
    rounds = [round_of(t) for t in (1, 2, 3)]
    for name in ("a.png", "b.png"):
        sphere.write_figure(tmp_path / name, rounds, "uncertainty")
    assert (tmp_path / "a.png").read_bytes() == (tmp_path / "b.png").read_bytes()
    width, height = image_files.read_size(tmp_path / "a.png")
    assert width >= 1000 and height > width  # two panels side by side, the third below
    assert [p.name for p in sorted(tmp_path.iterdir())] == ["a.png", "b.png"]
