"""The verdict on structure from motion: made models that are right, and wrong in one way each."""

import numpy as np
import pytest
from fixtures import photos as synth

from dav_gswt.errors import InputError
from dav_gswt.geometry.scene_frame import SfmSign, SfmVerdict
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
