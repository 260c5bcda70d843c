"""JPEGs for pages: small pictures whose bytes are the same each time."""

import io

import numpy as np
from jaxtyping import Float
from matplotlib.image import imsave
from numpy import ndarray as Array


def encode_jpeg(image: Float[Array, "h w 3"], quality: int) -> bytes:
    """A progressive JPEG of sRGB-encoded colours in [0, 1]; quality: 1 to 95."""
    pixels = np.rint(np.clip(image, 0, 1) * 255).astype(np.uint8)
    buffer = io.BytesIO()
    options = {"quality": quality, "optimize": True, "progressive": True}
    imsave(buffer, np.ascontiguousarray(pixels), format="jpeg", pil_kwargs=options)
    return buffer.getvalue()
