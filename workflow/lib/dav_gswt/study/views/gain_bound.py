"""The bound of view selection: the photo whose refit truly gains most, chosen greedily, beside what policies reach.

All policies choose from the same pool of photos, from the same start, and their fields are refitted alike, so what
differs is the choice alone. `gain` refits the field with each of some candidates and takes the one that lowers the
mean squared error of the test views most: nobody who photographs can do that, and no score can choose better by itself.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy import ndarray as Array

from dav_gswt.geometry.poses import pose_of_camera, select_farthest_poses
from dav_gswt.geometry.scene_frame import SceneFrame
from dav_gswt.images.lpips_weights import Weights
from dav_gswt.logs import progress
from dav_gswt.photos.training_views import TrainingView
from dav_gswt.raster import render
from dav_gswt.reconstruction import evaluation
from dav_gswt.reconstruction.coarse import Reconstruction, StartViews, fit_coarse_field
from dav_gswt.reconstruction.fit_settings import CoarseSettings, UpdateSettings
from dav_gswt.reconstruction.observation import mask_to_ground
from dav_gswt.reconstruction.refinement import RefinementInput, refine_field
from dav_gswt.views.coverage import DirectionalCoverage, GroundCells, measure_cell_errors
from dav_gswt.views.greedy import lazy_greedy
from dav_gswt.views.scoring import scoring_camera

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

    coarse: CoarseSettings
    update: UpdateSettings
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
        given = RefinementInput(base.field, base.grid, self.pool.frame, known, new[earlier:])
        return refine_field(given, self.settings.update, np.random.default_rng([*self.seed, earlier]))


Chooser = Callable[[State], list[TrainingView]]


def choose_farthest(state: State) -> list[TrainingView]:
    """Each photo the farthest from all before."""
    return _spread(state, state.taken, state.settings.k)


def choose_at_random(state: State) -> list[TrainingView]:
    """k of the photos that are left."""
    order = np.random.default_rng([*state.seed, 1]).permutation(len(state.left))
    return [state.left[i] for i in order[: state.settings.k]]


def choose_by_coverage_error(state: State) -> list[TrainingView]:
    """The default policy: directional coverage, each cell by the field's error in the photos so far."""
    cells = GroundCells(state.made.field, state.made.grid)
    corrected = state.pool.frame.kind == "photos"  # photos differ in exposure
    importance = measure_cell_errors(cells, state.taken, corrected)
    taken, left = ([scoring_camera(view.camera) for view in views] for views in (state.taken, state.left))
    gain = DirectionalCoverage(cells, taken, left, importance)
    return [state.left[i] for i in lazy_greedy(gain.gains(), gain.gain, gain.take, state.settings.k)]


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


POLICIES: dict[str, Chooser] = {
    "farthest": choose_farthest,
    "random": choose_at_random,
    "coverage-error": choose_by_coverage_error,
    "gain": choose_by_gain,
}


def measure_error(made: Reconstruction, tests: list[TrainingView]) -> float:
    """Mean squared error of the test views over the ground that counts."""
    errors, pixels = 0.0, 0.0
    for view in mask_to_ground(tests, made.grid):
        apart = (np.clip(render(made.field, view.camera).colour, 0, 1) - view.image).astype(np.float64)
        errors += float((view.weight * (apart**2).mean(-1)).sum())
        pixels += float(view.weight.sum())
    return errors / max(pixels, 1.0)


def compare_choices(
    pool: Pool, settings: BoundSettings, seeds: Sequence[int], policies: Sequence[str] = tuple(POLICIES)
) -> list[dict]:
    """A row of COLUMNS for the first fit, and for every policy and round; the first fit has no policy."""
    rows = []
    for seed in seeds:
        start = StartViews(pool.frame, pool.start, pool.points, pool.colours, pool.margin)
        first = fit_coarse_field(start, settings.coarse, np.random.default_rng(seed))
        rows.append(_describe(pool, settings, first, {"seed": seed, "round": 0, "photos": len(pool.start)}))
        for policy in policies:
            made, taken, left = first, list(pool.start), list(pool.photos)
            for t in range(1, settings.rounds + 1):
                state = State(pool, settings, made, taken, left, (seed, t))
                new = POLICIES[policy](state)
                made = state.refit(new)
                taken, left = taken + new, [view for view in left if all(view is not other for other in new)]
                case = {"policy": policy, "seed": seed, "round": t, "photos": len(taken)}
                rows.append(_describe(pool, settings, made, case))
    return rows


def _spread(state: State, taken: list[TrainingView], count: int) -> list[TrainingView]:
    """Photos that are left, each the farthest from all before."""
    frame = state.pool.frame
    poses = [pose_of_camera(view.name, view.camera, frame) for view in state.left]
    places = np.array([view.camera.centre - frame.exemplar.centre for view in taken])
    return [state.left[i] for i in select_farthest_poses(poses, count, places)]


def _describe(pool: Pool, settings: BoundSettings, made: Reconstruction, case: dict) -> dict:
    found = evaluation.evaluate_field(made.field, mask_to_ground(pool.tests, made.grid), weights=settings.weights)
    return dict.fromkeys(COLUMNS) | case | {name: found[name] for name in evaluation.MEASURES}
