"""Flicker of the terrain on a walk: changes from frame to frame, in pre-sorted orders and sorted exactly.

Moving changes a picture by itself: what pre-sorting adds is seen against the same two frames with all Gaussians sorted
exactly. Where the eye enters another cell other tiles are sorted exactly, and orders change most: half of the pairs of
frames lie across such a border, half anywhere on the way.
"""

from dataclasses import replace

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array

from dav_gswt.bundle.manifest import Manifest
from dav_gswt.geometry.cameras import Camera
from dav_gswt.logs import progress
from dav_gswt.terrain import stills
from dav_gswt.terrain.endless import EndlessTerrain
from dav_gswt.terrain.stills import Shot
from dav_gswt.terrain.visibility import coarsen_to_budget

STEP = 0.02  # eye floors from a frame to the next: the page's walking pace, 1.2 eye heights a second, at 60 frames
MAX_RATIO = 2.0  # of the largest change, over that of the exactly sorted walk


def walk_shots(frames: int, length: float, height: float) -> list[Shot]:
    """Shots of a straight walk from the walker's place: `length` in tiles, `height` in eye floors above the surface."""
    walker = stills.SHOTS[0]
    yaw = np.radians(walker.yaw)
    way = np.linspace(0, length, frames)[:, None] * [np.cos(yaw), np.sin(yaw)] + walker.at
    return [replace(walker, name=f"{k:04d}", at=tuple(at), height=float(height)) for k, at in enumerate(way.tolist())]


def make_frame_pairs(count: int, length: float, step: float) -> list[tuple[Shot, Shot]]:
    """Pairs of consecutive frames of a walk `length` tiles long, `step` tiles apart.

    Every second pair is moved to where the walk next enters another cell: half a step before and half a step after.
    """
    way = walk_shots(count, length, 1.0)
    rows = []
    for k, shot in enumerate(way):
        yaw = np.radians(shot.yaw)
        ahead = np.array([np.cos(yaw), np.sin(yaw)])
        at = np.array(shot.at)
        if k % 2:
            at = at + ahead * (_distance_to_border(at, ahead) - 0.5 * step)
        rows.append(tuple(replace(shot, at=tuple(p.tolist())) for p in (at, at + step * ahead)))
    return rows


def _distance_to_border(at: Float[Array, "2"], ahead: Float[Array, "2"]) -> float:
    """Tiles until x or y is the next whole number; ahead: without negative components."""
    return float(min((np.floor(p) + 1 - p) / a for p, a in zip(at, ahead, strict=True) if a > 0))


def measure_flicker(
    terrain: EndlessTerrain, manifest: Manifest, count: int, length: float, width: int, height: int, budget: int
) -> list[dict]:
    """A row for each pair of frames: largest and mean difference of a pixel, in 8-bit steps, in pre-sorted orders
    (`largest`, `mean`) and sorted exactly (`exact_largest`, `exact_mean`); border: between its frames the eye enters
    another cell. budget: at most so many Gaussians are in view, in both frames at one coarseness."""
    floor, rows = manifest.eye_floor, []
    pairs = make_frame_pairs(count, length, STEP * floor / terrain.side)
    for k, shots in enumerate(progress(pairs, "measure flicker")):
        cameras = [stills.shot_camera(shot, terrain, floor, width, height) for shot in shots]
        row = {"pair": k, "east": shots[0].at[0], "north": shots[0].at[1], "border": k % 2}
        coarser = coarsen_to_budget(terrain, cameras[0], budget)
        rows.append(
            row
            | _measure_changes(coarser, manifest, cameras, False)
            | _measure_changes(coarser, manifest, cameras, True)
        )
    return rows


def _measure_changes(terrain: EndlessTerrain, manifest: Manifest, cameras: list[Camera], exact: bool) -> dict:
    background = manifest.sky, manifest.ground_colour
    before, after = (stills.render_view(terrain, camera, *background, exact=exact) for camera in cameras)
    change, name = 255 * np.abs(after - before), "exact_" if exact else ""
    return {f"{name}largest": float(change.max()), f"{name}mean": float(change.mean())}


def compare_largest_changes(rows: list[dict]) -> float:
    """The largest change of the walk over that of the exactly sorted walk; acceptable below MAX_RATIO."""
    return max(row["largest"] for row in rows) / max(row["exact_largest"] for row in rows)
