"""Between cameras that look at the exemplar's centre and the axes of the rig that carries one: pan, tilt, radius.

pan is the azimuth from `pan_zero` on, tilt the elevation from `tilt_zero` on, both in degrees; radius is the distance
to the exemplar's centre in millimetres.
"""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array

from dav_gswt.geometry.cameras import Camera
from dav_gswt.photos.synthetic import camera_layouts

PAST = 2.0  # degrees that a pose may be turned away from how the rig holds its camera


@dataclass(frozen=True)
class Mount:
    """How a rig stands about the scene. centre: what it turns about. millimetres: in one unit of the world."""

    centre: Float[Array, "3"]
    millimetres: float
    pan_zero: float
    tilt_zero: float

    def axes(self, camera: Camera) -> Float[Array, "3"]:
        """Where the axes are when the rig's camera stands where this one does; pan from 0 to 360.

        The pan is read from the picture's right side, which tells also straight above which way is up. A thousandth of
        a degree and of a millimetre is what the line carries.
        """
        out = camera.centre - self.centre
        radius = float(np.linalg.norm(out))
        elevation = np.degrees(np.arcsin(np.clip(out[2] / max(radius, 1e-12), -1, 1)))
        azimuth = np.degrees(np.arctan2(-camera.rotation[0, 0], camera.rotation[0, 1]))
        axes = [(self.pan_zero + azimuth) % 360.0, self.tilt_zero + elevation, self.millimetres * radius]
        return np.round(axes, 3)

    def camera(self, axes: Float[Array, "3"], asked: Camera) -> Camera:
        """The camera at a place of the axes, with the lens of the one that was asked for."""
        pan, tilt, radius = axes
        elevation = np.clip(tilt - self.tilt_zero, -90.0, 90.0)  # a rig straight above reports a little too much
        size = (asked.width, asked.height)
        posed = camera_layouts.orbit(
            elevation, pan - self.pan_zero, radius / self.millimetres, self.centre, *size, 60.0
        )
        return replace(asked, rotation=posed.rotation, translation=posed.translation)

    def trouble(self, camera: Camera) -> str | None:
        """Why no place of the axes holds the camera as this one is turned; None where one does."""
        axes = self.axes(camera)
        if not axes[2] > 0:
            return "it is at the centre that the rig turns about"
        held = self.camera(axes, camera).rotation
        angle = np.degrees(np.arccos(np.clip((np.trace(held.T @ camera.rotation) - 1) / 2, -1, 1)))
        if angle <= PAST:
            return None
        return f"it is turned {angle:.1f} degrees away from how the rig looks: at the exemplar's centre, upright"
