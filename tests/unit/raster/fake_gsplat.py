"""What of gsplat 1.5 our `cuda` backend calls, on the CPU, by the oracle's mathematics: its arguments, shapes, names.

Where gsplat differs from us this does too: alpha stops at .999. An argument that gsplat does not have is refused, and a
shape that it would refuse is as well.
"""

import numpy as np
import torch

from dav_gswt.cameras import Camera
from dav_gswt.raster import oracle

ALPHA_MAX = 0.999
TILE = 16


def rasterization(
    means,
    quats,
    scales,
    opacities,
    colors,
    viewmats,
    Ks,
    width,
    height,
    near_plane=0.01,
    far_plane=1e10,
    eps2d=0.3,
    sh_degree=None,
    packed=True,
    render_mode="RGB",
    rasterize_mode="classic",
    camera_model="pinhole",
):
    n = len(means)
    assert quats.shape == (n, 4) and scales.shape == (n, 3) and opacities.shape == (n,)
    assert viewmats.shape == (1, 4, 4) and Ks.shape == (1, 3, 3) and not packed and render_mode == "RGB+D"
    k = Ks[0].tolist()
    camera = Camera(np.eye(3), np.zeros(3), k[0][0], k[1][1], k[0][2], k[1][2], width, height, camera_model == "ortho")
    view = viewmats[0, :3, :3], viewmats[0, :3, 3]
    if sh_degree is not None:
        assert colors.shape == (n, (sh_degree + 1) ** 2, 3)
        towards = means - torch.inverse(viewmats[0])[:3, 3]
        colors = (0.5 + (oracle.basis(towards, colors.shape[1])[..., None] * colors).sum(1)).clamp(min=0)
    assert colors.ndim == 2
    # double before what cancels: gsplat's own roundings are not what is tested here
    given = [a.double() for a in (means, scales.double().log(), quats, torch.logit(opacities.double()), colors)]
    view = tuple(v.double() for v in view)
    splats = oracle.project(*given, camera, view, near_plane, eps2d, rasterize_mode == "antialiased")
    near_enough = (splats.depth >= near_plane) & (splats.depth <= far_plane)
    assert near_enough.all()
    conics = splats.roots.mT @ splats.roots
    conics = torch.stack([conics[:, 0, 0], conics[:, 0, 1], conics[:, 1, 1]], 1)
    weight = _weights(splats.centres, conics, splats.opacity, width, height)
    seen = weight @ torch.cat([splats.colours, splats.depth[:, None]], 1)

    def back(values):  # one row a Gaussian, as without packing; what is culled is not initialised
        return torch.full((1, n, *values.shape[1:]), torch.nan).index_copy(1, splats.index, values[None].float())

    radii = torch.zeros(1, n, 2, dtype=torch.int32)
    radii[0, splats.index] = (weight > 0).any(0)[:, None].int() * 5
    meta = {"means2d": back(splats.centres), "conics": back(conics), "opacities": back(splats.opacity)}
    meta |= {"radii": radii, "tile_size": TILE, "flatten_ids": splats.index.int()}
    meta["isect_offsets"] = torch.zeros(1, -(-height // TILE), -(-width // TILE), dtype=torch.int32)
    alpha = weight.sum(1).reshape(1, height, width, 1)
    return seen.reshape(1, height, width, -1).float(), alpha.float(), meta


def rasterize_to_indices_in_range(
    range_start,
    range_end,
    transmittances,
    means2d,
    conics,
    opacities,
    image_width,
    image_height,
    tile_size,
    isect_offsets,
    flatten_ids,
):
    assert transmittances.shape == (1, image_height, image_width) and (transmittances == 1).all()
    assert range_start == 0 and range_end > len(flatten_ids) and tile_size == TILE
    g = flatten_ids.long()
    weight = _weights(*(a[0, g].double() for a in (means2d, conics, opacities)), image_width, image_height)
    pixels, at = torch.nonzero(weight > 0).unbind(1)  # by pixel, then from front to back
    return flatten_ids[at], pixels, torch.zeros_like(pixels)


def _weights(centres, conics, opacity, width, height):
    pixels = torch.stack([torch.arange(width * height) % width, torch.arange(width * height) // width], 1) + 0.5
    d = pixels[:, None] - centres
    sigma = 0.5 * (conics[:, 0] * d[..., 0] ** 2 + conics[:, 2] * d[..., 1] ** 2) + conics[:, 1] * d.prod(-1)
    alpha = opacity * torch.exp(-sigma)
    alpha = torch.where(alpha < 1 / 255, 0, alpha.clamp(max=ALPHA_MAX))
    clear = torch.cumprod(1 - alpha, 1)
    before = torch.cat([torch.ones_like(clear[:, :1]), clear[:, :-1]], 1)
    return torch.where(clear > 1e-4, alpha * before, 0)
