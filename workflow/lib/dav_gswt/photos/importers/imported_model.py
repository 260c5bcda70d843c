"""An imported model: the pose and the lens of each photo, and points of the scene if the file has any."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
import pycolmap
from jaxtyping import Float, Float32, Int
from numpy import ndarray as Array

from dav_gswt.geometry.georeference import Georeference


@dataclass(frozen=True)
class ImportedImage:
    """One image of the model. A world point p has camera coordinates rotation @ p + translation (x right, y down).

    name: relative to the photos' folder, with slashes. lens: at the size that the model gives, of the picture as it is
    stored; None where no size is known because there is no such photo.
    """

    name: str
    lens: pycolmap.Camera | None
    rotation: Float[Array, "3 3"]
    translation: Float[Array, "3"]


@dataclass(frozen=True)
class ImportedModel:
    """The images of a model, n points, and m observations: image image_of[k] sees point point_of[k] at pixels[k].

    colours: sRGB in [0, 1]. reasons: of images that the file has, but that cannot be taken with the others.
    about: the place of the world's origin, where the world is known to be metres east, north and up.
    """

    shots: tuple[ImportedImage, ...]
    points: Float[Array, "n 3"] = field(default_factory=lambda: np.zeros((0, 3)))
    colours: Float32[Array, "n 3"] = field(default_factory=lambda: np.zeros((0, 3), np.float32))
    point_of: Int[Array, "m"] = field(default_factory=lambda: np.zeros(0, int))
    image_of: Int[Array, "m"] = field(default_factory=lambda: np.zeros(0, int))
    pixels: Float[Array, "m 2"] = field(default_factory=lambda: np.zeros((0, 2)))
    reasons: Mapping[str, str] = field(default_factory=dict)
    about: Georeference | None = None
