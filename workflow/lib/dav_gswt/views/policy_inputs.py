"""Inputs of single policies beside the scores, computed only for the policies that need them."""

from pathlib import Path

import numpy as np
from jaxtyping import Float64
from numpy import ndarray as Array

from dav_gswt.errors import InputError
from dav_gswt.field import read_field
from dav_gswt.geometry.cameras import Camera
from dav_gswt.geometry.scene_frame import read_scene_frame
from dav_gswt.reconstruction import ground
from dav_gswt.views import fisher, oracle
from dav_gswt.views.candidates import Candidates
from dav_gswt.views.policies import InformationGain
from dav_gswt.views.policy_names import NEEDS_FIELD, ORACLES
from dav_gswt.views.scores import Scores
from dav_gswt.views.scoring import scoring_camera


def build_information_gain(
    policy: str, scores: Scores, candidates: Candidates, taken: list[Camera], file: Path | str
) -> InformationGain | None:
    """Build the information gain for policies with `needs_field`; None for others.

    taken: cameras of the photos so far. file: the field. Candidates are in the order of the scores.
    """
    if policy not in NEEDS_FIELD:
        return None
    at = {pose.name: camera for pose, camera in candidates}
    return fisher.FisherInformation(
        read_field(file), [scoring_camera(c) for c in taken], [scoring_camera(at[name]) for name in scores.names]
    )


def measure_true_errors(
    policy: str, scores: Scores, candidates: Candidates, files: dict[str, Path | str], scene: dict, size: int
) -> Float64[Array, "n"] | None:
    """Measure the true error at each candidate for policies with `needs_truth`; None for others.

    files: `field`, `ground`, `frame`, `truth` (folder of true pictures of candidates), and for a replayed scene
    `images`. size: see `oracle.measure_errors`.
    Returns: NaN where the true picture is unknown. Raises: InputError: it is unknown at every candidate.
    """
    if policy not in ORACLES:
        return None
    if scene["agent"] == "replay":
        some, views = candidates, list(oracle.render_truth(scene, candidates, files["images"]))
    else:
        some, views = oracle.read_truth(candidates, files["truth"])
    corrected = read_scene_frame(files["frame"]).kind == "photos"  # photos differ in exposure
    found, _ = oracle.measure_errors(
        read_field(files["field"]), ground.read_ground(files["ground"]), views, size, corrected
    )
    known = {pose.name: error for (pose, _), error in zip(some, found, strict=True)}
    if not known:
        raise InputError(f"{files['truth']}: shows no candidate that is left; make it again with more of them")
    return np.array([known.get(name, np.nan) for name in scores.names])
