"""Where the ground of a terrain lies, on a plane or on a sphere: its cells in view, their Gaussians, what is behind."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Protocol, runtime_checkable

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array

from dav_gswt.bundle.manifest import Sky
from dav_gswt.field import GaussianField
from dav_gswt.geometry import cameras
from dav_gswt.geometry.cameras import Camera
from dav_gswt.terrain.backdrop import Backdrop
from dav_gswt.terrain.displacement import Slope
from dav_gswt.terrain.endless import EndlessTerrain
from dav_gswt.terrain.placement import place_cell
from dav_gswt.terrain.scatter import Instances
from dav_gswt.terrain.sphere import Sphere, frame_at, walk_from
from dav_gswt.terrain.sphere_backdrop import SphereBackdrop
from dav_gswt.terrain.sphere_cells import visible_on_sphere
from dav_gswt.terrain.sphere_placement import place_on_sphere
from dav_gswt.terrain.visibility import GridCells, visible_cells

START = (20.0, 30.0)  # longitude and latitude that places on a sphere count from, in degrees


@runtime_checkable
class GroundMapping(Protocol):
    """What the renderer of stills asks of the ground, as the functions of the same name do it for a plane."""

    def find_cells(self, camera: Camera) -> GridCells: ...

    def place_cell(
        self, terrain: EndlessTerrain, cell: GridCells, eye: Float[Array, "3"], things: Instances | None
    ) -> tuple[GaussianField, Slope]: ...

    def make_backdrop(self, eye: Float[Array, "3"], sky: Sky, ground_colour: Sequence[float] | Array) -> Backdrop: ...

    def stand(self, at: Float[Array, "2"], height: float) -> tuple[Float[Array, "3"], Float[Array, "3 3"]]:
        """The eye at a height above the surface, and east, north and up there. at: world units from the first place."""
        ...


class Plane:
    """The plane z = 0 under a height field."""

    def __init__(self, terrain: EndlessTerrain):
        self.terrain = terrain

    def find_cells(self, camera: Camera) -> GridCells:
        return visible_cells(self.terrain, camera)

    def place_cell(
        self, terrain: EndlessTerrain, cell: GridCells, eye: Float[Array, "3"], things: Instances | None
    ) -> tuple[GaussianField, Slope]:
        return place_cell(terrain, cell, eye, things)

    def make_backdrop(self, eye: Float[Array, "3"], sky: Sky, ground_colour: Sequence[float] | Array) -> Backdrop:
        return Backdrop.for_eye(self.terrain, eye, sky, ground_colour)

    def stand(self, at: Float[Array, "2"], height: float) -> tuple[Float[Array, "3"], Float[Array, "3 3"]]:
        ground, _ = self.terrain.heights.at(at[:1], at[1:])
        return np.array([*at, ground[0] + height]), np.eye(3)


class Planet:
    """A sphere about the world's origin."""

    def __init__(self, terrain: EndlessTerrain, sphere: Sphere):
        self.terrain, self.sphere = terrain, sphere

    def find_cells(self, camera: Camera) -> GridCells:
        return visible_on_sphere(self.terrain, self.sphere, camera)

    def place_cell(
        self, terrain: EndlessTerrain, cell: GridCells, eye: Float[Array, "3"], things: Instances | None
    ) -> tuple[GaussianField, Slope]:
        return place_on_sphere(terrain, self.sphere, cell, eye)

    def make_backdrop(self, eye: Float[Array, "3"], sky: Sky, ground_colour: Sequence[float] | Array) -> Backdrop:
        return SphereBackdrop.for_eye(self.terrain, eye, sky, ground_colour)

    def stand(self, at: Float[Array, "2"], height: float) -> tuple[Float[Array, "3"], Float[Array, "3 3"]]:
        axes = walk_from(frame_at(*START), at, self.sphere.radius)
        return (self.sphere.radius + height) * axes[2], axes


def mapping_of(terrain: EndlessTerrain) -> GroundMapping:
    """The mapping of a terrain's surface."""
    return Planet(terrain, terrain.heights) if isinstance(terrain.heights, Sphere) else Plane(terrain)


def camera_on(
    eye: Float[Array, "3"], axes: Float[Array, "3 3"], yaw: float, pitch: float, width: int, height: int
) -> Camera:
    """The camera of an eye with a horizontal field of view of 60 degrees.

    Args:   axes: east, north and up. yaw: degrees from east to the left. pitch: degrees above the level, over -90.
    """
    up, turn = np.radians(pitch), np.radians(yaw)
    ahead = np.array([np.cos(up) * np.cos(turn), np.cos(up) * np.sin(turn), np.sin(up)])
    here = cameras.pinhole(np.zeros(3), ahead, width, height, 60.0)
    rotation = here.rotation @ axes
    return replace(here, rotation=rotation, translation=-rotation @ eye)
