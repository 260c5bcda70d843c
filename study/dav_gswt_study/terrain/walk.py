"""Shots of a walk."""

from dataclasses import replace

import numpy as np

from dav_gswt.terrain.stills import SHOTS, Shot


def walk_shots(frames: int, length: float, height: float) -> list[Shot]:
    """Shots of a straight walk from the walker's place: `length` in tiles, `height` in eye floors above the surface."""
    walker = SHOTS[0]
    yaw = np.radians(walker.yaw)
    way = np.linspace(0, length, frames)[:, None] * [np.cos(yaw), np.sin(yaw)] + walker.at
    return [replace(walker, name=f"{k:04d}", at=tuple(at), height=float(height)) for k, at in enumerate(way.tolist())]
