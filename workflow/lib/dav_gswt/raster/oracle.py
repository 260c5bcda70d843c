"""The oracle: the same pictures in plain PyTorch, every Gaussian against every pixel. For small scenes, in float64.

`project` brings Gaussians onto the screen and `weights` blends them there; both have the type and the device of the
tensors they are given. It shares no code with the core and none of its shortcuts; gradients come from autograd.
"""

from dataclasses import dataclass

import numpy as np
import torch
from jaxtyping import Float, Int
from torch import Tensor

from dav_gswt.geometry.cameras import Camera
from dav_gswt.raster import harmonics

ALPHA_MIN, ALPHA_MAX, CLEAR_MIN = 1 / 255, 0.99, 1e-4
MARGIN = 0.15  # of the picture's side: further out the camera is linearised at this rim


@dataclass(frozen=True)
class Splats:
    """Gaussians on the screen, from front to back. index: which Gaussian each is."""

    index: Int[Tensor, "m"]
    centres: Float[Tensor, "m 2"]  # pixels
    roots: Float[Tensor, "m 2 2"]  # |root d|^2 is the exponent -2 log(alpha / opacity) at d from the centre
    opacity: Float[Tensor, "m"]
    colours: Float[Tensor, "m c"]
    depth: Float[Tensor, "m"]

    @property
    def shapes(self) -> Float[Tensor, "m 6"]:
        """What `weights` needs of them: centre, the three entries of the root, opacity."""
        return torch.cat([self.centres, self.roots.flatten(1)[:, [0, 1, 3]], self.opacity[:, None]], 1)


def project(
    means: Float[Tensor, "n 3"],
    log_scales: Float[Tensor, "n 3"],
    quats: Float[Tensor, "n 4"],
    opacity_logits: Float[Tensor, "n"],
    colours: Float[Tensor, "n c"] | Float[Tensor, "n k 3"],
    camera: Camera,
    near: float = 0.01,
    dilation: float = 0.3,
    antialiased: bool = False,
) -> Splats:
    """The splats of the Gaussians before the near plane, by depth, those of equal depth by index."""
    view = rotation, translation = tuple(
        torch.tensor(np.asarray(v)).to(means) for v in (camera.rotation, camera.translation)
    )
    q = means @ rotation.T + translation
    visible = q[:, 2] > 0 if camera.orthographic else q[:, 2] >= near
    index = torch.nonzero(visible)[:, 0]
    index = index[torch.argsort(q[index, 2].detach(), stable=True)]
    q, opacity = q[index], torch.sigmoid(opacity_logits[index])
    axes = rotations(quats[index]) * log_scales[index].exp()[:, None, :]
    centres, jacobian = projection(q, camera)
    c = jacobian @ rotation @ axes
    roots, kept = roots_of(c, dilation)
    if antialiased:
        opacity = opacity * kept
    colours = colours[index]
    if colours.ndim == 3:
        colours = seen_from(colours, means[index], camera, view)
    return Splats(index, centres, roots, opacity, colours, q[:, 2])


def roots_of(c: Float[Tensor, "m 2 3"], dilation: float) -> tuple[Float[Tensor, "m 2 2"], Float[Tensor, "m"]]:
    """Upper triangular roots of the inverse of S = c c^T + dilation, and sqrt(det(c c^T) / det S), what an antialiased
    splat keeps of its opacity.

    With S = [[p, r], [r, s]] the root is [[sqrt(s / det), -r / sqrt(s det)], [0, 1 / sqrt(s)]]. det(c c^T) is the
    squared length of the cross product of c's rows (Lagrange), so that no difference of large numbers is taken; where
    it is 0 so are the ratio and its gradient. A splat without area and dilation has the root infinity: it is nowhere.
    """
    p, r, s = (c[:, 0] ** 2).sum(1) + dilation, (c[:, 0] * c[:, 1]).sum(1), (c[:, 1] ** 2).sum(1) + dilation
    area = (torch.linalg.cross(c[:, 0], c[:, 1]) ** 2).sum(1)
    det = area + dilation * (p + s - dilation)
    zero = torch.zeros_like(p)
    roots = torch.stack([(s / det).sqrt(), -r / (s * det).sqrt(), zero, s.rsqrt()], 1).reshape(-1, 2, 2)
    ratio = area / det
    return roots, torch.where(ratio > 0, torch.where(ratio > 0, ratio, 1).sqrt(), 0)


def weights(shapes: Float[Tensor, "*b m 6"], pixels: Float[Tensor, "*b p 2"]) -> Float[Tensor, "*b p m"]:
    """Blend weights of all splats, given front to back, at some pixels."""
    x, y, r00, r01, r11, opacity = shapes[..., None, :, :].unbind(-1)
    dx, dy = pixels[..., 0, None] - x, pixels[..., 1, None] - y
    alpha = opacity * torch.exp(-0.5 * ((r00 * dx + r01 * dy) ** 2 + (r11 * dy) ** 2))
    alpha = torch.where(alpha < ALPHA_MIN, 0, alpha.clamp(max=ALPHA_MAX))
    clear = torch.cumprod(1 - alpha, -1)
    before = torch.cat([torch.ones_like(clear[..., :1]), clear[..., :-1]], -1)
    return torch.where(clear >= CLEAR_MIN, alpha * before, 0)  # clear only falls: what follows is left out too


def seen_from(sh: Float[Tensor, "m k 3"], means: Float[Tensor, "m 3"], camera: Camera, view) -> Float[Tensor, "m 3"]:
    """Colours of spherical harmonics from the camera: max(0, 0.5 + sum over k of basis_k sh_k)."""
    rotation, translation = view
    towards = rotation[2].expand(len(means), 3) if camera.orthographic else means + rotation.T @ translation
    return (0.5 + torch.einsum("mk,mkc->mc", basis(towards, sh.shape[1]), sh)).clamp(min=0)


def basis(towards: Float[Tensor, "m 3"], k: int) -> Float[Tensor, "m k"]:
    """The first k real spherical harmonics of 3DGS in directions of any length; that of length 0 counts as +z."""
    length = towards.norm(dim=1, keepdim=True)
    up = torch.eye(3, dtype=towards.dtype, device=towards.device)[2]
    x, y, z = torch.where(length > 0, towards / torch.where(length > 0, length, 1), up).unbind(1)
    return torch.stack(harmonics.list_terms(x, y, z, 3)[:k], 1)


def projection(q: Float[Tensor, "m 3"], camera: Camera) -> tuple[Float[Tensor, "m 2"], Float[Tensor, "m 2 3"]]:
    """Pixel positions of points in the camera's frame, and the projection's Jacobian there."""
    f, principal, size = (
        torch.tensor(v, dtype=q.dtype, device=q.device)
        for v in ((camera.fx, camera.fy), (camera.cx, camera.cy), (float(camera.width), float(camera.height)))
    )
    if camera.orthographic:
        jacobian = torch.cat([torch.diag(f), torch.zeros(2, 1).to(q)], 1)
        return q[:, :2] * f + principal, jacobian.expand(len(q), 2, 3)
    slope = q[:, :2] / q[:, 2:]
    low, high = (-principal - MARGIN * size) / f, (size - principal + MARGIN * size) / f
    bound = torch.minimum(torch.maximum(slope, low), high)
    per_z = f / q[:, 2:]
    return slope * f + principal, torch.cat([torch.diag_embed(per_z), (-per_z * bound)[..., None]], 2)


def rotations(quats: Float[Tensor, "m 4"]) -> Float[Tensor, "m 3 3"]:
    """Rotation matrices of quaternions w x y z of any length but 0."""
    w, x, y, z = (quats / quats.norm(dim=1, keepdim=True)).unbind(1)
    rows = [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)]
    rows += [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)]
    rows += [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)]
    return torch.stack(rows, 1).reshape(-1, 3, 3)
