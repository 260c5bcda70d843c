"""JPEGs for pages: small pictures whose bytes are the same each time."""

import io

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array
from PIL import Image


def encode_jpeg(image: Float[Array, "h w 3"], quality: int) -> bytes:
    """A progressive JPEG of sRGB-encoded colours in [0, 1]; quality: 1 to 95."""
    pixels = np.rint(np.clip(image, 0, 1) * 255).astype(np.uint8)
    buffer = io.BytesIO()
    Image.fromarray(pixels).save(buffer, "JPEG", quality=quality, optimize=True, progressive=True)
    return buffer.getvalue()
