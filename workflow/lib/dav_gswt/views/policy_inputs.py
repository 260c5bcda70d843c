"""What single policies need beside the scores: opened for those that ask for it, and for no others."""

from pathlib import Path

import numpy as np
from jaxtyping import Float64
from numpy import ndarray as Array

from dav_gswt.errors import InputError
from dav_gswt.field import read_field
from dav_gswt.geometry.cameras import Camera
from dav_gswt.geometry.scene_frame import read_scene_frame
from dav_gswt.reconstruction import ground
from dav_gswt.views import fisher
from dav_gswt.views.candidates import Candidates
from dav_gswt.views.policies import InformationGain
from dav_gswt.views.policy_names import NEEDS_FIELD, ORACLES
from dav_gswt.views.scores import Scores
from dav_gswt.views.scoring import scoring_camera


def build_information_gain(
    policy: str, scores: Scores, pool: Candidates, taken: list[Camera], file: Path | str
) -> InformationGain | None:
    """For `fisher`: the information that photos give about a field's file, candidates in the order of the scores."""
    if policy not in NEEDS_FIELD:
        return None
    at = {pose.name: camera for pose, camera in pool}
    return fisher.FisherInformation(
        read_field(file), [scoring_camera(c) for c in taken], [scoring_camera(at[name]) for name in scores.names]
    )


def measure_true_errors(
    policy: str, scores: Scores, pool: Candidates, files: dict[str, Path | str], scene: dict, size: int
) -> Float64[Array, "n"] | None:
    """For oracles: the true error at each candidate, NaN where its truth was not drawn.

    files: `field`, `ground`, `frame`, and `truth`, the folder of what candidates truly show; `images`, the photos of a
    scene that is replayed. size: see `measures.measure_errors`.
    Raises: InputError: no candidate's truth is known.
    """
    if policy not in ORACLES:
        return None
    from dav_gswt.study.calibration import measures, truth

    if scene["agent"] == "replay":
        some, views = pool, list(truth.render_truth(scene, pool, files["images"]))
    else:
        some, views = truth.read_truth(pool, files["truth"])
    corrected = read_scene_frame(files["frame"]).kind == "photos"  # which change their exposure
    found, _ = measures.measure_errors(
        read_field(files["field"]), ground.read_ground(files["ground"]), views, size, corrected
    )
    known = {pose.name: error for (pose, _), error in zip(some, found, strict=True)}
    if not known:
        raise InputError(f"{files['truth']}: shows no candidate that is left; make it again with more of them")
    return np.array([known.get(name, np.nan) for name in scores.names])
