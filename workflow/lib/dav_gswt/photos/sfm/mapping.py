"""Mapping: features and matches of a database become cameras and points, by COLMAP in one thread."""

import logging
from collections.abc import Mapping
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np
import pycolmap
from jaxtyping import Float
from numpy import ndarray as Array

from dav_gswt.logs import progress
from dav_gswt.photos.colmap_model import bundle_adjust
from dav_gswt.photos.sfm.features import run_cancellable
from dav_gswt.photos.sfm.gps import make_pose_prior

_log = logging.getLogger(__name__)

Mapper = Literal["incremental", "global"]


@dataclass(frozen=True)
class Approach:
    """A way of mapping. hold_focal: EXIF's focal length stays, whatever photos say. use_gps: positions are priors."""

    mapper: Mapper
    hold_focal: bool = False
    use_gps: bool = False

    def __str__(self) -> str:
        held = ", EXIF's focal length held" if self.hold_focal else ""
        return f"{self.mapper} mapping{', GPS as priors' if self.use_gps else ''}{held}"


def list_alternatives(first: Approach, freed: bool, gps: bool) -> list[Approach]:
    """Other ways for photos whose model may be wrong. freed: EXIF's focal length was given up. gps: with positions."""
    out = [Approach(first.mapper, hold_focal=True)] if freed else []
    out += [Approach("incremental", hold_focal=True, use_gps=True)] if gps else []
    return [*out, Approach(other_mapper(first.mapper), hold_focal=True)]


def other_mapper(mapper: Mapper) -> Mapper:
    """The one of the two that `mapper` is not."""
    return "incremental" if mapper == "global" else "global"


def run_mapping(
    approach: Approach, database: Path, scratch: Path, held: Mapping[int, float], seed: int
) -> list[pycolmap.Reconstruction]:
    """The models that photos of a database give, of any number of photos. held: focal lengths of EXIF by camera.

    Where only some cameras have a known focal length, those stay as they are until the end.
    """
    with closing(pycolmap.Database.open(database)) as store:
        mixed = 0 < len(held) < store.num_cameras()
        count = store.num_images()
    if approach.mapper == "global":
        return _map_globally(bool(held), database, scratch, seed)
    choice = pycolmap.IncrementalPipelineOptions(num_threads=1, random_seed=seed, max_num_models=3)
    choice.mapper.num_threads = 1
    choice.mapper.random_seed = choice.triangulation.random_seed = seed
    choice.use_prior_position = choice.use_robust_loss_on_prior_position = approach.use_gps
    if held and not mixed:
        choice.ba_refine_focal_length = choice.mapper.abs_pose_refine_focal_length = False
    if mixed:
        choice.constant_cameras = set(held)
    with progress(range(count), "place photos") as bar:

        def report() -> None:
            bar.update(int(bar.n < count))  # COLMAP counts a photo again that it tries to place again

        found = run_cancellable(
            lambda token: pycolmap.incremental_mapping(
                database, scratch, scratch, choice, next_image_callback=report, cancellation_token=token
            )
        )
    if mixed:
        for reconstruction in found.values():
            bundle_adjust(reconstruction, refine_focal_length=False)
    return list(found.values())


def write_pose_priors(database: Path, at: Mapping[str, Float[Array, "3"]]) -> None:
    """Enter GPS positions into a database, in place of those that it has.

    at: metres east, north and up by the images' names; NaN where unknown.
    """
    with closing(pycolmap.Database.open(database)) as store:
        store.clear_pose_priors()
        for image in store.read_all_images():
            if image.name in at and np.isfinite(at[image.name]).all():
                store.write_pose_prior(make_pose_prior(image, at[image.name]))


def _map_globally(known: bool, database: Path, scratch: Path, seed: int) -> list[pycolmap.Reconstruction]:
    """All photos at once. known: EXIF has focal lengths."""
    choice = pycolmap.GlobalPipelineOptions(num_threads=1, random_seed=seed)
    choice.mapper.num_threads = 1
    choice.mapper.random_seed = seed
    for part in (choice.mapper.rotation_averaging, choice.mapper.global_positioning):
        part.random_seed = seed
    choice.mapper.global_positioning.use_gpu = False
    adjustment = choice.mapper.bundle_adjustment
    adjustment.refine_focal_length = not known
    adjustment.ceres.use_gpu = False
    adjustment.ceres.solver_options.num_threads = 1
    return list(pycolmap.global_mapping(database, scratch, scratch, choice).values())
