"""The bound of view selection: the photo whose refit truly gains most, chosen greedily, beside what policies reach.

All policies choose from the same pool of photos, from the same start, and their fields are refitted alike, so what
differs is the choice alone. `gain` refits the field with each of some candidates and takes the one that lowers the
mean squared error of the test views most: nobody who photographs can do that, and no score can choose better by itself.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array

from dav_gswt.geometry.poses import Pose, pose_of_camera, select_farthest_poses
from dav_gswt.geometry.scene_frame import SceneFrame
from dav_gswt.images.lpips_weights import Weights
from dav_gswt.logs import progress
from dav_gswt.photos.training_views import TrainingView
from dav_gswt.raster import render
from dav_gswt.reconstruction import evaluation
from dav_gswt.reconstruction.coarse import Reconstruction, StartViews, fit_coarse_field
from dav_gswt.reconstruction.fitting.plan import FitSettings
from dav_gswt.reconstruction.observation import mask_to_ground
from dav_gswt.reconstruction.update import UpdateInput, update_field
from dav_gswt.views import policies
from dav_gswt.views.candidates import camera_positions
from dav_gswt.views.coverage import DirectionalCoverage, GroundCells, measure_cell_errors
from dav_gswt.views.policies import NEEDS_FIELD, SelectionInput
from dav_gswt.views.scores import Scores
from dav_gswt.views.scoring import scoring_camera
from dav_gswt.views.uncertainty import Scales

GAIN = "gain"  # in place of a policy: the choice by true gain
COMPARED = ("farthest", "random", "coverage-error", GAIN)
COLUMNS = ("policy", "seed", "round", "photos", *evaluation.MEASURES)
TRIED = 16  # candidates that `gain` refits with for each photo, spread over the pool


@dataclass(frozen=True)
class Pool:
    """start: photos of the first fit. photos: to choose from. points, colours: matched in the start."""

    frame: SceneFrame
    start: list[TrainingView]
    photos: list[TrainingView]
    tests: list[TrainingView]
    points: Array
    colours: Array
    margin: float


@dataclass(frozen=True)
class BoundSettings:
    """k: photos a round. weights: of LPIPS; without them it is not measured."""

    coarse: FitSettings
    update: FitSettings
    k: int
    rounds: int
    weights: Weights | None


@dataclass(frozen=True)
class State:
    """What a policy knows before a round: the field, the photos taken, and those that are left."""

    pool: Pool
    settings: BoundSettings
    made: Reconstruction
    taken: list[TrainingView]
    left: list[TrainingView]
    seed: tuple[int, int]  # of the run, and the round

    def refit(self, new: list[TrainingView], made: Reconstruction | None = None, earlier: int = 0) -> Reconstruction:
        """The field refitted with new photos. made: instead of the field. earlier: of the new ones, already in it."""
        base = made or self.made
        known = self.taken + new[:earlier]
        given = UpdateInput(base.field, base.grid, self.pool.frame, known, new[earlier:])
        return update_field(given, self.settings.update, np.random.default_rng([*self.seed, earlier]))


def choose_by_policy(policy: str, state: State) -> list[TrainingView]:
    """The k photos that a policy of the rounds chooses."""
    poses = _describe_poses(state.left, state.pool.frame)
    scores = Scores(poses, {}, Scales({}), np.zeros(len(poses), int))
    information = _measure_coverage(state) if policy in NEEDS_FIELD else None
    places = _list_places(state.taken, state.pool.frame)
    inputs = SelectionInput(places, state.settings.k, np.random.default_rng([*state.seed, 1]), information=information)
    return [state.left[i] for i in policies.POLICIES[policy].choose(scores, inputs)]


def choose_by_gain(state: State) -> list[TrainingView]:
    """Each photo the one whose refit lowers the error of the test views most; the next is tried on that refit."""
    chosen: list[TrainingView] = []
    made = state.made
    for n in range(state.settings.k):
        left = [view for view in state.left if all(view is not other for other in chosen)]
        tried = _spread(replace(state, left=left), state.taken + chosen, TRIED)
        refits = [state.refit([*chosen, view], made, n) for view in progress(tried, f"try photo {n + 1}")]
        errors = [measure_error(refit, state.pool.tests) for refit in refits]
        best = int(np.argmin(errors))
        chosen.append(tried[best])
        made = refits[best]
    return chosen


def measure_error(made: Reconstruction, tests: list[TrainingView]) -> float:
    """Mean squared error of the test views over the ground that counts."""
    errors, pixels = 0.0, 0.0
    for view in mask_to_ground(tests, made.grid):
        apart = (np.clip(render(made.field, view.camera).colour, 0, 1) - view.image).astype(np.float64)
        errors += float((view.weight * (apart**2).mean(-1)).sum())
        pixels += float(view.weight.sum())
    return errors / max(pixels, 1.0)


def compare_choices(
    pool: Pool, settings: BoundSettings, seeds: Sequence[int], compared: Sequence[str] = COMPARED
) -> list[dict]:
    """A row of COLUMNS for the first fit, and for every policy and round; the first fit has no policy."""
    rows = []
    for seed in seeds:
        start = StartViews(pool.frame, pool.start, pool.points, pool.colours, pool.margin)
        first = fit_coarse_field(start, settings.coarse, np.random.default_rng(seed))
        rows.append(_describe(pool, settings, first, {"seed": seed, "round": 0, "photos": len(pool.start)}))
        for policy in compared:
            made, taken, left = first, list(pool.start), list(pool.photos)
            for t in range(1, settings.rounds + 1):
                state = State(pool, settings, made, taken, left, (seed, t))
                new = choose_by_gain(state) if policy == GAIN else choose_by_policy(policy, state)
                made = state.refit(new)
                taken, left = taken + new, [view for view in left if all(view is not other for other in new)]
                case = {"policy": policy, "seed": seed, "round": t, "photos": len(taken)}
                rows.append(_describe(pool, settings, made, case))
    return rows


def _measure_coverage(state: State) -> DirectionalCoverage:
    """What `coverage-error` reads."""
    cells = GroundCells(state.made.field, state.made.grid)
    corrected = state.pool.frame.kind == "photos"  # photos differ in exposure
    taken, left = ([scoring_camera(view.camera) for view in views] for views in (state.taken, state.left))
    errors = measure_cell_errors(cells, state.taken, corrected)
    return DirectionalCoverage(cells, cells.view(taken), cells.view(left), errors)


def _spread(state: State, taken: list[TrainingView], count: int) -> list[TrainingView]:
    """Photos that are left, each the farthest from all before."""
    frame = state.pool.frame
    chosen = select_farthest_poses(_describe_poses(state.left, frame), count, _list_places(taken, frame))
    return [state.left[i] for i in chosen]


def _describe_poses(views: list[TrainingView], frame: SceneFrame) -> list[Pose]:
    return [pose_of_camera(view.name, view.camera, frame) for view in views]


def _list_places(views: list[TrainingView], frame: SceneFrame) -> Float[Array, "n 3"]:
    """Relative to the exemplar's middle."""
    return camera_positions([view.camera for view in views], frame)


def _describe(pool: Pool, settings: BoundSettings, made: Reconstruction, case: dict) -> dict:
    found = evaluation.evaluate_field(made.field, mask_to_ground(pool.tests, made.grid), weights=settings.weights)
    return dict.fromkeys(COLUMNS) | case | {name: found[name] for name in evaluation.MEASURES}
