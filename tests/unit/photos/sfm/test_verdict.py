"""The verdict on structure from motion, of made models that are wrong in one way each, and which model is taken."""

from pathlib import Path

import numpy as np
import pycolmap
import pytest
from fixtures import photos as synth

from dav_gswt.errors import InputError
from dav_gswt.geometry.scene_frame import FocalLength, SfmSign, SfmVerdict
from dav_gswt.photos.colmap_model import select_points, write_colmap_model
from dav_gswt.photos.sfm import mapping
from dav_gswt.photos.sfm.mapping import Approach, SfmPhoto, SfmScene, SfmSolution
from dav_gswt.photos.sfm.verdict import (
    THRESHOLDS,
    combine_grades,
    judge_model,
    require_trust,
)

HEIGHT = 40.0  # metres in a unit of the made models


@pytest.fixture(scope="module")
def model():
    """A flight over ground with a little relief."""
    rng = np.random.default_rng(1)
    return synth.model(synth.flight(4, 5), synth.plain(3000, 0.9, rng, relief=0.02), noise=0.3, rng=rng)


@pytest.fixture(scope="module")
def fog():
    """What a wrong focal length makes of a flight: cameras that look down, points in an upright sheet of fog."""
    rng = np.random.default_rng(2)
    points = np.c_[rng.normal(0, 0.05, 6000), rng.uniform(-1, 1, 6000), rng.uniform(-2, 0.8, 6000)]
    return synth.model(synth.flight(4, 7, step=0.2), points)


def positions(model, noise: float, seed: int = 3):
    """GPS positions of a model's cameras, `noise` metres off."""
    centres = HEIGHT * np.stack([camera.centre for camera in model.cameras])
    return centres + np.random.default_rng(seed).normal(0, noise / np.sqrt(3), centres.shape)


def judge(model, **evidence) -> SfmVerdict:
    known = {"error": 0.4, "images": len(model.names)} | evidence
    return judge_model(model, np.random.default_rng(0), **known)


def grades(verdict: SfmVerdict) -> dict[str, str]:
    return {sign.name: sign.grade for sign in verdict.signs}


def test_a_good_model_is_good_by_every_sign(model):
    verdict = judge(model, focal_ratio=1.1, positions=positions(model, 3.0))
    assert verdict.grade == "good" and not verdict.objections
    assert set(grades(verdict)) == set(THRESHOLDS)
    bare = judge(model)
    assert bare.grade == "good" and not {"GPS", "focal length", "ground"} & set(grades(bare))


def test_fog_of_a_wrong_focal_length_is_refused(fog):
    """Also without EXIF: the ground stands upright under a flight that looks down."""
    verdict = judge(fog, error=1.39, focal_ratio=1 / 1.7)
    assert verdict.grade == "refused"
    assert grades(verdict)["roughness"] == grades(verdict)["focal length"] == "refused"
    assert grades(verdict)["reprojection error"] == "doubtful"
    bare = judge(fog)
    assert grades(bare)["tilt"] == "refused" and bare.grade == "refused"


def test_gps_alone_makes_a_model_doubtful(model):
    verdict = judge(model, positions=positions(model, 90.0))
    assert grades(verdict)["GPS"] == "refused" and verdict.grade == "doubtful"
    assert grades(judge(model, positions=positions(model, 4.0)))["GPS"] == "good"
    drift = judge(model, positions=positions(model, 1.0) + np.linspace(0, 80, 20)[:, None] * [0, 0, 1])
    assert grades(drift)["GPS"] == "good"  # altitudes drift in flights that are right


@pytest.mark.parametrize(("ties", "grade"), [(7, "refused"), (30, "doubtful"), (60, "good")])
def test_photos_that_hang_on_the_others_by_a_few_points_are_named(model, ties, grade):
    (sign,) = (sign for sign in judge(synth.loosen(model, 5, ties)).signs if sign.name == "hangs together")
    assert sign.grade == grade
    assert grade == "good" or sign.reason.startswith(f"only {ties} points tie 015, 016, 017, ... to")


def signs(*grades: tuple[str, str]) -> list[SfmSign]:
    return [SfmSign(name, grade, "a reason") for name, grade in grades]


@pytest.mark.parametrize(
    "found, grade",
    [
        ([], "good"),
        ([("tilt", "doubtful")], "doubtful"),
        ([("tilt", "refused")], "doubtful"),
        ([("tilt", "refused"), ("GPS", "doubtful")], "refused"),
        ([("tilt", "doubtful"), ("GPS", "doubtful"), ("relief", "doubtful")], "refused"),
        ([("reprojection error", "refused")], "refused"),
        ([("placed", "refused"), ("tilt", "doubtful")], "doubtful"),
    ],
)
def test_signs_are_weighed_together(found, grade):
    assert combine_grades(signs(*found)) == grade


@pytest.mark.parametrize(
    ("found", "message"),
    [
        ([("tilt", "refused"), ("relief", "refused")], "show no ground: a reason; a reason. Photograph an open patch"),
        ([("tilt", "refused"), ("reprojection error", "refused")], "do not fit together to one scene.* it is wrong$"),
        (
            [("tilt", "refused"), ("relief", "doubtful"), ("hangs together", "doubtful")],
            "do not fit together to one scene.* a room or a table: Photograph an open patch",
        ),
    ],
)
def test_a_refused_model_says_what_to_photograph_or_to_mend(found, message):
    with pytest.raises(InputError, match=message):
        require_trust(SfmVerdict("refused", tuple(signs(*found))))


def verdict(grade: str, *names: str) -> SfmVerdict:
    return SfmVerdict(grade, tuple(SfmSign(name, grade, f"{name} is odd") for name in names))


class Placed(pycolmap.Reconstruction):
    """A model of which only the number of its images is known; they are the first ones."""

    def __init__(self, count: int):
        super().__init__()
        self.count = count

    def num_reg_images(self) -> int:
        return self.count

    def reg_image_ids(self) -> list[int]:
        return list(range(1, self.count + 1))


@pytest.fixture
def solutions(monkeypatch):
    """Ways of mapping that give what a test says, and no others; the ways that were asked for."""
    asked = []

    def give(*verdicts, placed=(8, 8, 8), unsure=0):
        def solve(approach, scene, seed):
            asked.append(approach)
            if verdicts[len(asked) - 1] is None:
                raise InputError(f"way {len(asked)} places nothing")
            focal = FocalLength(300.0, 330.0, 330.0, 30.0, "freed")
            return SfmSolution(Placed(placed[len(asked) - 1]), (), focal, verdicts[len(asked) - 1], unsure)

        monkeypatch.setattr(mapping, "_solve", solve)
        scene = SfmScene("folder", [], {1: 300.0}, {}, Path("database.db"))
        return mapping.find_solution(scene, 0), asked

    return give


def test_the_best_of_several_ways_is_taken_and_all_are_named(solutions):
    found, asked = solutions(verdict("refused", "tilt", "GPS"), verdict("good"), verdict("doubtful", "tilt"))
    assert asked[1:] == [Approach("incremental", hold_focal=True), Approach("global", hold_focal=True)]
    assert found.verdict.grade == "good" and len(found.verdict.tried) == 3
    assert found.verdict.tried[0] == "incremental mapping: refused (tilt is odd; GPS is odd)"


def test_photos_without_a_place_are_named_with_what_they_share():
    photos = [SfmPhoto(Path(f"{i}.jpg"), f"{i}.png", (4, 3), 4, 3, None) for i in range(5)]
    pairs = [(0, 1, 90), (0, 2, 40), (2, 1, 50), (2, 3, 70), (4, 0, 1)]
    (two, three, four), unsure = mapping.explain_left_out(photos, {0, 1}, pairs)
    assert unsure == 1
    assert two[0] == "2.jpg" and "shares 50 points" in two[1]
    assert three[0] == "3.jpg" and "matches no photo" in three[1] and "shares 1 points" in four[1]


def test_photos_that_hang_on_the_others_by_a_few_points_lose_their_place(tmp_path):
    rng = np.random.default_rng(1)
    whole = synth.model(synth.flight(3, 4), synth.plain(800, 0.9, rng, relief=0.02))
    for ties, lost in ((7, {8: 7, 9: 7, 10: 7, 11: 7}), (60, {})):
        loose = synth.loosen(whole, 4, ties)
        write_colmap_model(select_points(loose, np.bincount(loose.point_of, minlength=800) >= 2), tmp_path)
        best = pycolmap.Reconstruction(str(tmp_path))
        assert mapping.remove_loose_photos(best) == lost
        assert best.num_reg_images() == 12 - len(lost)
        assert min(point.track.length() for point in best.points3D.values()) >= 2
    photos = [SfmPhoto(Path(f"{i}.jpg"), f"{i}.png", (4, 3), 4, 3, None) for i in range(3)]
    ((name, reason),), _ = mapping.explain_left_out(photos, {0, 1}, [(0, 1, 90), (0, 2, 40)], {2: 7})
    assert name == "2.jpg" and reason.startswith("only 7 points tie it to the other photos")
