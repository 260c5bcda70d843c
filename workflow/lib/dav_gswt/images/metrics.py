"""How good a picture is: PSNR and SSIM, over the pixels that count, raw and with its exposure corrected."""

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array


def psnr(a: Float[Array, "h w 3"], b: Float[Array, "h w 3"], weight: Float[Array, "h w"]) -> float | None:
    """Peak signal-to-noise ratio in dB over pixels of weight > 0, for values in [0, 1]; None if they are equal.

    Raises: ValueError: no pixel counts.
    """
    if not (total := float(weight.sum())) > 0:
        raise ValueError("no pixel of the picture counts: its weight is 0 everywhere")
    error = float((((a - b).astype(float) ** 2).mean(-1) * weight).sum() / total)
    return None if error == 0 else -10 * np.log10(error)


def colour_corrected(
    picture: Float[Array, "h w 3"], photo: Float[Array, "h w 3"], weight: Float[Array, "h w"]
) -> Float[Array, "h w 3"]:
    """The picture fitted to the photo by a least-squares gain and offset per channel: photos change exposure."""
    keep = weight > 0
    out = np.empty_like(picture)
    for c in range(3):
        x, y = picture[keep, c].astype(float), photo[keep, c].astype(float)
        gain = ((x - x.mean()) * (y - y.mean())).mean() / max(x.var(), 1e-9)
        out[..., c] = gain * (picture[..., c] - x.mean()) + y.mean()
    return out


def ssim(a: Float[Array, "h w 3"], b: Float[Array, "h w 3"], weight: Float[Array, "h w"]) -> float:
    """Structural similarity (Wang et al. 2004; 11-tap Gaussian window), mean over pixels of weight > 0."""
    import torch  # here, not above: most jobs need neither it nor kornia, and they take seconds to load
    from kornia.metrics import ssim as ssim_map

    first, second = (torch.from_numpy(np.ascontiguousarray(x, np.float32)).movedim(-1, 0)[None] for x in (a, b))
    values = ssim_map(first, second, 11)[0].mean(0).numpy()
    return float((values * weight).sum() / weight.sum())
