"""Scores of candidate poses: how much of what a camera would see there is not known yet."""

import numpy as np
from jaxtyping import Float32
from numpy import ndarray as Array

from dav_gswt.active.poses import Pose, Scored
from dav_gswt.cameras import Camera
from dav_gswt.coarse.doubt import uncertainty_map
from dav_gswt.coarse.ground import Ground
from dav_gswt.coarse.maps import from_above
from dav_gswt.field import Field
from dav_gswt.logs import progress
from dav_gswt.raster import Rasterizer
from dav_gswt.views import View, over_ground

WIDTH = 96  # pixels of a picture that is only scored


def score(
    field: Field, grid: Ground, candidates: list[tuple[Pose, Camera]]
) -> tuple[list[Scored], dict[str, Float32[Array, "h w"]]]:
    """Every candidate's scores, and its uncertainty map.

    opacity: mean of the uncertainty map over the pixels that look at the modelled ground; 0 where none does.
    """
    raster = Rasterizer()
    west, south, side = grid.exemplar
    scored, maps = [], {}
    for pose, camera in progress(candidates, "score poses"):
        small = camera.resized(WIDTH, max(1, round(WIDTH * camera.height / camera.width)))
        doubt = uncertainty_map(field, small, raster)
        blank = View(pose.name, small, np.zeros((*doubt.shape, 3), np.float32), np.ones(doubt.shape, np.float32))
        weight = over_ground(blank, west, south, west + side, south + side).weight
        scored.append(Scored(pose, float((doubt * weight).sum() / max(1.0, weight.sum()))))
        maps[pose.name] = doubt
    return scored, maps


def parts(
    field: Field, grid: Ground, scored: list[Scored], maps: dict[str, Float32[Array, "h w"]], others: int = 16
) -> dict[str, tuple[dict[str, Array], dict[str, str]]]:
    """The maps to keep, as parts of an EXR: the ground from above, and candidates evenly over the ranking.

    Each part's header says which pose it is of.
    """
    ranked = sorted(scored, key=lambda s: -s.opacity)
    kept = ranked[:: max(1, len(ranked) // others)][:others]
    above = {"above": ({"uncertainty": from_above(field, grid).uncertainty[::-1]}, {"camera": "straight above"})}
    return above | {
        s.pose.name: (
            {"uncertainty": maps[s.pose.name]},
            {k: repr(getattr(s.pose, k)) for k in ("elevation", "azimuth", "radius")} | {"opacity": repr(s.opacity)},
        )
        for s in kept
    }
