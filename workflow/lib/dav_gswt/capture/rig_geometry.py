"""Conversion between cameras and the axes of a rig: pan, tilt, radius.

pan is the azimuth plus `pan_zero`, tilt the elevation plus `tilt_zero`, both in degrees; radius is the distance to the
exemplar's centre in millimetres.
"""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array

from dav_gswt.geometry import camera_layouts
from dav_gswt.geometry.cameras import Camera

TOLERANCE = 2.0  # degrees between a pose and how the rig holds its camera


@dataclass(frozen=True)
class Mount:
    """Position of a rig in the scene. centre: what it turns about. millimetres: per world unit."""

    centre: Float[Array, "3"]
    millimetres: float
    pan_zero: float
    tilt_zero: float

    def axes_of(self, camera: Camera) -> Float[Array, "3"]:
        """Axes at which the rig holds this camera; pan from 0 to 360.

        The pan follows from the camera's x axis, which is defined also straight above. Rounded to 0.001, the resolution
        of the protocol.
        """
        out = camera.centre - self.centre
        radius = float(np.linalg.norm(out))
        elevation = np.degrees(np.arcsin(np.clip(out[2] / max(radius, 1e-12), -1, 1)))
        azimuth = np.degrees(np.arctan2(-camera.rotation[0, 0], camera.rotation[0, 1]))
        axes = [(self.pan_zero + azimuth) % 360.0, self.tilt_zero + elevation, self.millimetres * radius]
        return np.round(axes, 3)

    def camera_at(self, axes: Float[Array, "3"], like: Camera) -> Camera:
        """Camera at a position of the axes, with the lens of `like`."""
        pan, tilt, radius = axes
        elevation = np.clip(tilt - self.tilt_zero, -90.0, 90.0)  # a rig straight above reports a little too much
        size = (like.width, like.height)
        posed = camera_layouts.orbit(
            elevation, pan - self.pan_zero, radius / self.millimetres, self.centre, *size, 60.0
        )
        return replace(like, rotation=posed.rotation, translation=posed.translation)

    def find_violation(self, camera: Camera) -> str | None:
        """Say why no position of the axes gives this camera's orientation; None if one does."""
        axes = self.axes_of(camera)
        if not axes[2] > 0:
            return "it is at the centre that the rig turns about"
        held = self.camera_at(axes, camera).rotation
        angle = np.degrees(np.arccos(np.clip((np.trace(held.T @ camera.rotation) - 1) / 2, -1, 1)))
        if angle <= TOLERANCE:
            return None
        return f"it is turned {angle:.1f} degrees away from how the rig looks: at the exemplar's centre, upright"
