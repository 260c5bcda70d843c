"""The compressed PLY of PlayCanvas and SuperSplat: four 32-bit words a Gaussian, and bounds of each 256 of them.

https://github.com/playcanvas/splat-transform, `read-ply` and `decompress-ply`.
"""

import numpy as np
from jaxtyping import Float, Float32, UInt32
from numpy import ndarray as Array

COLUMNS = ("packed_position", "packed_rotation", "packed_scale", "packed_color")
GROUP = 256  # Gaussians that share their bounds


def unpack_vertices(bounds: Array | None, rows: Array) -> dict[str, Float32[Array, "n ..."]]:
    """The columns of a field, by the names of `GaussianField`, and `colours`, from the tables `chunk` and `vertex`.

    Opacities of 0 and 1 are infinite logits. Raises: ValueError: bounds or a word are missing or of another type.
    """
    words = [_require(rows, name, "u4") for name in COLUMNS]
    if bounds is None or len(bounds) * GROUP < len(rows):
        raise ValueError("a compressed PLY without the bounds of all its Gaussians (element chunk)")
    group = np.arange(len(rows)) // GROUP
    colours = _split(words[3], (24, 16, 8, 0), (8, 8, 8, 8))
    if "min_r" in (bounds.dtype.names or ()):
        colours[:, :3] = _stretch(colours[:, :3], bounds, ("r", "g", "b"), group)
    with np.errstate(divide="ignore"):
        logits = np.log(colours[:, 3]) - np.log1p(-colours[:, 3])
    small = (_split(words[1], (20, 10, 0), (10, 10, 10)) - np.float32(0.5)) * np.float32(np.sqrt(2))  # of quaternions
    return {
        "means": _stretch(_split(words[0], (21, 11, 0), (11, 10, 11)), bounds, ("x", "y", "z"), group),
        "log_scales": _stretch(
            _split(words[2], (21, 11, 0), (11, 10, 11)), bounds, ("scale_x", "scale_y", "scale_z"), group
        ),
        "quats": expand_smallest_three(words[1] >> 30, small),
        "opacity_logits": logits,
        "colours": colours[:, :3],
    }


def _require(rows: Array, name: str, kind: str) -> Array:
    if name not in (rows.dtype.names or ()) or rows.dtype[name].str[1:] != kind:
        raise ValueError(f"a compressed PLY whose {name} is missing or of another type")
    return rows[name].astype(rows.dtype[name].newbyteorder("="))


def _split(words: UInt32[Array, "n"], shifts: tuple[int, ...], bits: tuple[int, ...]) -> Float32[Array, "n k"]:
    """Parts of words, each from 0 to 1."""
    pairs = [(shift, (1 << size) - 1) for shift, size in zip(shifts, bits, strict=True)]
    return np.stack([(words >> shift & most) / np.float32(most) for shift, most in pairs], 1).astype(np.float32)


def _stretch(
    shares: Float32[Array, "n 3"], bounds: Array, axes: tuple[str, ...], group: Array
) -> Float32[Array, "n 3"]:
    """Values from shares of what lies between the bounds of each group."""
    low, high = (np.stack([_require(bounds, f"{end}_{axis}", "f4") for axis in axes], 1) for end in ("min", "max"))
    with np.errstate(all="ignore"):  # the checks below refuse values that are not finite
        return low[group] * (1 - shares) + high[group] * shares


def expand_smallest_three(which: UInt32[Array, "n"], small: Float[Array, "n 3"]) -> Float32[Array, "n 4"]:
    """Unit vectors of four numbers, from the place of the largest one, which is positive, and the others in order."""
    others = np.array([[k for k in range(4) if k != largest] for largest in range(4)])
    quats, rows = np.empty((len(small), 4), np.float32), np.arange(len(small))
    quats[rows, which] = np.sqrt(np.maximum(1 - (small**2).sum(1), 0))
    quats[rows[:, None], others[which]] = small
    return quats
