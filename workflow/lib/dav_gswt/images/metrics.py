"""Image quality against a reference: PSNR and SSIM over weighted pixels, raw or after a colour correction."""

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array


def mse_to_psnr(mse: float) -> float | None:
    """Peak signal-to-noise ratio in dB of a mean squared error of values in [0, 1]; None where the error is 0."""
    return None if mse == 0 else float(-10 * np.log10(mse))


def psnr(a: Float[Array, "h w 3"], b: Float[Array, "h w 3"], weight: Float[Array, "h w"]) -> float | None:
    """PSNR in dB, the squared error averaged by weight, for values in [0, 1]; None if the pictures are equal.

    Raises: ValueError: the weight is 0 everywhere.
    """
    if not (total := float(weight.sum())) > 0:
        raise ValueError("no pixel of the picture counts: its weight is 0 everywhere")
    error = float((((a - b).astype(float) ** 2).mean(-1) * weight).sum() / total)
    return mse_to_psnr(error)


def correct_colours(
    picture: Float[Array, "h w 3"], photo: Float[Array, "h w 3"], weight: Float[Array, "h w"]
) -> Float[Array, "h w 3"]:
    """The picture after a least-squares gain and offset per channel that fit it to the photo's exposure."""
    keep = weight > 0
    out = np.empty_like(picture)
    for c in range(3):
        x, y = picture[keep, c].astype(float), photo[keep, c].astype(float)
        gain = ((x - x.mean()) * (y - y.mean())).mean() / max(x.var(), 1e-9)
        out[..., c] = gain * (picture[..., c] - x.mean()) + y.mean()
    return out


def ssim(a: Float[Array, "h w 3"], b: Float[Array, "h w 3"], weight: Float[Array, "h w"]) -> float:
    """Structural similarity (Wang et al. 2004; 11-tap Gaussian window), its map averaged by weight."""
    import torch  # deferred: torch and kornia take seconds to load, and most jobs need neither
    from kornia.metrics import ssim as ssim_map

    first, second = (torch.from_numpy(np.ascontiguousarray(x, np.float32)).movedim(-1, 0)[None] for x in (a, b))
    values = ssim_map(first, second, 11)[0].mean(0).numpy()
    return float((values * weight).sum() / weight.sum())
