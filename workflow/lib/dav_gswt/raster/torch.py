"""The oracle: the same pictures in plain PyTorch, float64, every Gaussian against every pixel. For small scenes.

It shares no code with the core and none of its shortcuts; gradients come from autograd.
"""

import numpy as np
import torch
from jaxtyping import Float
from numpy import ndarray as Array
from torch import Tensor

from dav_gswt.cameras import Camera
from dav_gswt.raster.cpu import Rendering

ALPHA_MIN, ALPHA_MAX, CLEAR_MIN = 1 / 255, 0.99, 1e-4
MARGIN = 0.15  # of the picture's side: further out the camera is linearised at this rim


def forward(
    means: Float[Tensor, "n 3"],
    log_scales: Float[Tensor, "n 3"],
    quats: Float[Tensor, "n 4"],
    opacity_logits: Float[Tensor, "n"],
    colours: Float[Tensor, "n c"],
    camera: Camera,
    near: float = 0.01,
    dilation: float = 0.3,
) -> tuple[Float[Tensor, "h w c"], Float[Tensor, "h w"], Float[Tensor, "h w"]]:
    """Colour, alpha and depth, differentiable; see `cpu.Rasterizer` for what they are."""
    rotation, translation = (torch.as_tensor(np.array(v, float)) for v in (camera.rotation, camera.translation))
    q = means @ rotation.T + translation
    drawn = q[:, 2] > 0 if camera.orthographic else q[:, 2] >= near
    index = torch.nonzero(drawn)[:, 0]
    index = index[torch.argsort(q[index, 2].detach(), stable=True)]
    q, colours, opacity = q[index], colours[index], torch.sigmoid(opacity_logits[index])
    axes = rotations(quats[index]) * log_scales[index].exp()[:, None, :]
    centres, jacobian = projection(q, camera)
    c = jacobian @ rotation @ axes
    conic = torch.linalg.inv(c @ c.mT + dilation * torch.eye(2, dtype=c.dtype))

    x, y = np.meshgrid(np.arange(camera.width) + 0.5, np.arange(camera.height) + 0.5)
    pixels = torch.as_tensor(np.stack([x.ravel(), y.ravel()], 1))
    d = pixels[:, None] - centres[None]
    alpha = opacity * torch.exp(-0.5 * torch.einsum("pni,nij,pnj->pn", d, conic, d))
    alpha = torch.where(alpha < ALPHA_MIN, 0, alpha.clamp(max=ALPHA_MAX))
    clear = torch.cumprod(1 - alpha, 1)
    before = torch.cat([torch.ones_like(clear[:, :1]), clear[:, :-1]], 1)
    weight = torch.where(clear >= CLEAR_MIN, alpha * before, 0)  # clear only falls: what follows is left out too
    size = camera.height, camera.width
    return (weight @ colours).reshape(*size, -1), weight.sum(1).reshape(size), (weight @ q[:, 2]).reshape(size)


def projection(q: Float[Tensor, "n 3"], camera: Camera) -> tuple[Float[Tensor, "n 2"], Float[Tensor, "n 2 3"]]:
    """Pixel positions of points in the camera's frame, and the projection's Jacobian there."""
    f = torch.tensor([camera.fx, camera.fy], dtype=q.dtype)
    principal = torch.tensor([camera.cx, camera.cy], dtype=q.dtype)
    if camera.orthographic:
        jacobian = torch.cat([torch.diag(f), torch.zeros(2, 1, dtype=q.dtype)], 1)
        return q[:, :2] * f + principal, jacobian.expand(len(q), 2, 3)
    slope = q[:, :2] / q[:, 2:]
    size = torch.tensor([camera.width, camera.height], dtype=q.dtype)
    low, high = (-principal - MARGIN * size) / f, (size - principal + MARGIN * size) / f
    bound = torch.minimum(torch.maximum(slope, low), high)
    per_z = f / q[:, 2:]
    return slope * f + principal, torch.cat([torch.diag_embed(per_z), (-per_z * bound)[..., None]], 2)


def rotations(quats: Float[Tensor, "n 4"]) -> Float[Tensor, "n 3 3"]:
    """Rotation matrices of quaternions w x y z of any length but 0."""
    w, x, y, z = (quats / quats.norm(dim=1, keepdim=True)).unbind(1)
    rows = [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)]
    rows += [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)]
    rows += [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)]
    return torch.stack(rows, 1).reshape(-1, 3, 3)


def rendered(*arrays: Float[Array, "..."], camera: Camera, near: float = 0.01, dilation: float = 0.3) -> Rendering:
    """`forward` of NumPy arrays, without gradients."""
    with torch.no_grad():
        images = forward(*(torch.as_tensor(a, dtype=torch.float64) for a in arrays), camera, near, dilation)
    return Rendering(*(image.numpy().astype(np.float32) for image in images))
