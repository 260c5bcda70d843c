"""The rasterizer in plain PyTorch, for machines that cannot build the C++ core: the same pictures, many times slower.

Gaussians are projected by the oracle's functions in float64 (exact for needles, and cheap) and blended in float32, in
squares of 8 x 8 pixels, each with the splats whose box meets it. Squares with similar numbers of splats are batched.
The backward pass blends again, so that no intermediate values are kept. Results have the same bits for the same number
of threads.
"""

import numpy as np
import torch
from jaxtyping import Bool, Float, Float32, Int
from numpy import ndarray as Array
from torch import Tensor

from dav_gswt.arrays import convolve, count_up
from dav_gswt.geometry.cameras import Camera
from dav_gswt.raster import interface, oracle
from dav_gswt.raster.interface import (
    AdamStep,
    Contributions,
    Forward,
    GaussianArrays,
    Gradients,
    PictureGradients,
    Rendering,
)
from dav_gswt.raster.oracle import ALPHA_MIN, Splats

SIDE = 8  # pixels: smaller squares mean more lists, larger ones more splats that miss most of their square
BATCH = 1 << 19  # splats times pixels that are blended at a time: a few MB an intermediate value
LARGEST = 1e12  # pixels of a centre, and one over pixels of a root: float32 ends at 3e38


# Squares of the picture that are blended together. Their pixels: row times the padded width plus column. The rows of
# their splats' tables, front to back; shorter lists are padded with the last row, which is empty.
Squares = tuple[Int[Tensor, "b p"], Int[Tensor, "b length"]]
Binned = tuple[list[Squares], Int[Tensor, "m"]]  # the splats of a forward pass, and which Gaussian each is


class Rasterizer(interface.Rasterizer):
    """See `interface.Rasterizer`. The number of threads is PyTorch's own (torch.set_num_threads)."""

    def _render(self, gaussians: GaussianArrays, camera: Camera) -> tuple[Rendering, Binned]:
        gaussians.check_values()
        with torch.no_grad():
            splats, shapes, values = self._project(to_leaves(gaussians), camera)
            groups = _group_squares(splats, camera)
            picture = _pad(torch.zeros(camera.height, camera.width, values.shape[1]))
            for pixels, rows in groups:
                weight = oracle.weights(shapes[rows], _place(pixels, picture.shape[1]))
                picture.view(-1, values.shape[1])[pixels] = weight @ values[rows]
        array = picture[: camera.height, : camera.width].numpy()
        parts = array[..., :-2], array[..., -2], array[..., -1]
        return Rendering(*(np.ascontiguousarray(part) for part in parts)), (groups, splats.index)

    @torch.enable_grad()
    def _differentiate(self, last: Forward, given: PictureGradients) -> Gradients:
        by_picture = _pad(join_gradients(last.rendering, given))
        leaves = {name: leaf.requires_grad_() for name, leaf in to_leaves(last.gaussians).items()}
        _, *tables = self._project(leaves, last.camera)
        by_tables = [torch.zeros_like(table) for table in tables]
        for pixels, rows in last.state[0]:
            shapes, values = (table.detach()[rows].requires_grad_() for table in tables)
            blended = oracle.weights(shapes, _place(pixels, by_picture.shape[1])) @ values
            parts = torch.autograd.grad(blended, (shapes, values), by_picture.flatten(0, 1)[pixels])
            for total, part in zip(by_tables, parts, strict=True):
                total.index_add_(0, rows.flatten(), part.flatten(0, 1))
        found = torch.autograd.grad(tables, list(leaves.values()), by_tables, materialize_grads=True)
        arrays = (np.ascontiguousarray(gradient.numpy(), np.float32) for gradient in found)
        return Gradients(**dict(zip(leaves, arrays, strict=True)))

    def _contribute(self, last: Forward, weights: Float32[Array, "h w c"]) -> Contributions:
        groups, index = last.state
        inside = np.ones((*weights.shape[:2], 1), np.float32)  # the padding beyond the picture counts for nothing
        maps = _pad(torch.as_tensor(np.concatenate([inside, weights], 2)))
        with torch.no_grad():
            _, shapes, _ = self._project(to_leaves(last.gaussians), last.camera)
            sums = torch.zeros(len(shapes), maps.shape[2])
            maximum = torch.zeros(len(shapes))
            for pixels, rows in groups:
                at, seen = rows.flatten(), maps.flatten(0, 1)[pixels]
                w = oracle.weights(shapes[rows], _place(pixels, maps.shape[1])) * seen[..., :1]
                sums.index_add_(0, at, (w.mT @ seen).flatten(0, 1))
                maximum.scatter_reduce_(0, at, w.amax(1).flatten(), "amax")
        found = torch.zeros(len(last.gaussians.means), maps.shape[2] + 1)
        found[index] = torch.cat([sums, maximum[:, None]], 1)[:-1]
        return Contributions(*(np.ascontiguousarray(found[:, i]) for i in (0, -1, slice(1, -1))))

    def _visible(self, last: Forward) -> Bool[Array, "n"]:
        groups, index = last.state
        visible = np.zeros(len(last.gaussians.means) + 1, bool)
        where = torch.cat([index, torch.tensor([len(visible) - 1])])
        for _, rows in groups:
            visible[where[rows.flatten()].numpy()] = True
        return visible[:-1]

    def _project(self, leaves: dict[str, Tensor], camera: Camera):
        """The splats, and two float32 tables of them that end in an empty row: centre, root and opacity; colours, 1
        and depth."""
        splats = oracle.project(
            **leaves, camera=camera, near=self.near, dilation=self.dilation, antialiased=self.antialiased
        )
        shapes = splats.shapes.clamp(-LARGEST, LARGEST)
        values = torch.cat([splats.colours, torch.ones_like(splats.depth)[:, None], splats.depth[:, None]], 1)
        return splats, *(torch.nn.functional.pad(table, (0, 0, 0, 1)).float() for table in (shapes, values))


def to_leaves(gaussians: GaussianArrays) -> dict[str, Tensor]:
    """Gaussians as float64 tensors."""
    return {name: torch.as_tensor(array).double() for name, array in vars(gaussians).items()}


def join_gradients(rendering: Rendering, given: PictureGradients) -> Float[Tensor, "h w c"]:
    """The gradients by the images as those by the channels of one picture."""
    parts = []
    for name, image in vars(rendering).items():
        gradient = given[name]
        parts.append((np.zeros_like(image) if gradient is None else gradient).reshape(*image.shape[:2], -1))
    return torch.as_tensor(np.concatenate(parts, 2))


def _pad(picture: Float[Tensor, "h w c"]) -> Float[Tensor, "rows columns c"]:
    """A picture padded to whole squares."""
    height, width = picture.shape[:2]
    return torch.nn.functional.pad(picture, (0, 0, 0, -width % SIDE, 0, -height % SIDE))


def _place(pixels: Int[Tensor, "b p"], width: int) -> Float32[Tensor, "b p 2"]:
    """The middles of pixels of a padded picture."""
    return torch.stack([pixels % width, pixels // width], -1) + 0.5


def _group_squares(splats: Splats, camera: Camera) -> list[Squares]:
    """The squares of the picture that splats meet, in groups with similar numbers of splats."""
    low, high = (bound // SIDE for bound in _bound_boxes(splats, camera))
    size = (high - low + 1).clamp(min=0)
    count = size.prod(1)
    rows = torch.repeat_interleave(torch.arange(len(count)), count)
    nth = torch.arange(len(rows)) - (torch.cumsum(count, 0) - count)[rows]
    width = -(-camera.width // SIDE)
    square = (low[rows, 1] + nth // size[rows, 0]) * width + low[rows, 0] + nth % size[rows, 0]
    rows = rows[torch.argsort(square, stable=True)]  # stable: from front to back in each square
    lengths = torch.bincount(square)
    first = torch.cumsum(lengths, 0) - lengths
    order = torch.argsort(lengths, descending=True, stable=True)
    order = order[: int((lengths > 0).sum())]
    inside = (torch.arange(SIDE)[:, None] * width * SIDE + torch.arange(SIDE)).flatten()
    groups, done = [], 0
    while done < len(order):
        longest = int(lengths[order[done]])
        some = order[done : done + max(1, BATCH // (longest * SIDE * SIDE))]
        place = torch.arange(longest)
        at = (first[some, None] + place).clamp(max=len(rows) - 1)
        theirs = torch.where(place < lengths[some, None], rows[at], len(count))
        first_pixel = (some // width * width * SIDE + some % width) * SIDE
        groups.append((first_pixel[:, None] + inside, theirs))
        done += len(some)
    return groups


def _bound_boxes(splats: Splats, camera: Camera) -> tuple[Int[Tensor, "m 2"], Int[Tensor, "m 2"]]:
    """First and last column and row of the pixels where a splat's alpha can reach 1/255; first > last for none."""
    reach = 2 * torch.log(splats.opacity / ALPHA_MIN)  # the exponent where alpha falls below it
    r00, r01, r11 = splats.roots.flatten(1)[:, [0, 1, 3]].unbind(1)
    variance = torch.stack([(r01**2 + r11**2) / (r00 * r11) ** 2, 1 / r11**2], 1)
    half = (reach.clamp(min=0)[:, None] * variance).sqrt() * (1 + 1e-5) + 1e-3  # wider than float32 can be off
    size = torch.tensor([camera.width, camera.height])
    low = torch.ceil(splats.centres - half - 0.5).clamp(min=0).minimum(size.double())
    high = torch.floor(splats.centres + half - 0.5).clamp(min=-1).minimum(size.double() - 1)
    none = (reach < -1e-5) | (low > high).any(1) | ~torch.isfinite(half).all(1)
    high[none] = -1
    low[none] = SIDE
    return low.long(), high.long()


def compute_loss(
    image: Float32[Array, "h w c"],
    target: Float32[Array, "h w c"],
    weight: Float32[Array, "h w"] | None,
    structure: float,
    threads: int | None = None,
    device: str = "cpu",
    dtype: torch.dtype = torch.float64,
) -> tuple[float, Float32[Array, "h w c"]]:
    """See `backends.loss`. threads: not used."""
    weight = np.ones(image.shape[:2], np.float32) if weight is None else weight
    x, y, w = (torch.tensor(a, dtype=dtype, device=device) for a in (image, target, weight))
    value, gradient = differentiate_loss(x, y, w, structure)
    return value.item(), np.ascontiguousarray(gradient.cpu().numpy(), np.float32)


def differentiate_loss(
    image: Float[Tensor, "h w c"], target: Float[Tensor, "h w c"], weight: Float[Tensor, "h w"], structure: float
) -> tuple[Float[Tensor, ""], Float[Tensor, "h w c"]]:
    """The loss of `backends.loss` and its gradient by the image: slopes of SSIM by the local means of x, xx and xy go
    back to the pixels that these were taken of."""
    x, y, w, c = image, target, weight[..., None], image.shape[2]
    sums = _window_sums(w * torch.cat([torch.ones_like(w), x, y, x * x, y * y, x * y], 2))
    per_n = torch.where(sums[..., :1] > 0, 1 / sums[..., :1], 0)
    a, b, aa, bb, ab = (sums[..., 1:] * per_n).split(c, 2)
    c1, c2, product = 0.01**2, 0.03**2, a * b
    mean, cross = 2 * product + c1, 2 * (ab - product) + c2
    per_mean = 1 / (a * a + b * b + c1)
    per_spread = 1 / (aa - a * a + bb - b * b + c2)
    per_both = per_mean * per_spread
    ssim, apart = mean * cross * per_both, x - y
    value = (w * ((1 - structure) * apart.abs() + structure * (1 - ssim))).mean()
    by_x = 2 * (b * (cross - mean) * per_both - a * ssim * (per_mean - per_spread))
    slopes = torch.cat([by_x, -ssim * per_spread, 2 * mean * per_both], 2) * (w * per_n)
    by_x, by_xx, by_xy = _window_sums(slopes).split(c, 2)
    by_structure = by_x + 2 * x * by_xx + y * by_xy
    return value, w * ((1 - structure) * apart.sign() - structure * by_structure) / image.numel()


def _window_sums(values: Float[Tensor, "h w c"]) -> Float[Tensor, "h w c"]:
    """Sums over each pixel's window of 11 x 11, weighted by a Gaussian of sigma 1.5."""
    taps = torch.exp(-((count_up(11, values) - 5) ** 2) / (2 * 1.5**2))
    taps = (taps / taps.sum()).to(values.dtype)
    return convolve(values.permute(2, 0, 1)[None], taps, padding=5)[0].permute(1, 2, 0)


def step_adam(s: AdamStep) -> None:
    """See `backends.adam`."""
    rows = slice(None) if s.rows is None else np.flatnonzero(s.rows)
    arrays = s.values, s.gradient, s.first, s.second
    value, g, m, v = (torch.from_numpy(a.reshape(len(a), -1)[rows]) for a in arrays)
    move_by_adam(AdamStep(value, g, m, v, torch.as_tensor(s.rates), s.step, s.betas, s.epsilon, None))
    if s.rows is not None:
        for array, new in ((s.values, value), (s.first, m), (s.second, v)):
            array.reshape(len(array), -1)[rows] = new.numpy()


def move_by_adam(s: AdamStep) -> None:
    """See `backends.adam`: the step of tensors, on any device."""
    shares = [torch.full_like(s.first[:, :1], 1 - beta) if s.rows is None else (1 - beta) * s.rows for beta in s.betas]
    s.first.lerp_(s.gradient, shares[0])
    s.second.lerp_(s.gradient * s.gradient, shares[1])
    move = s.first / (1 - s.betas[0] ** s.step)
    move /= (s.second / (1 - s.betas[1] ** s.step)).sqrt_().add_(s.epsilon)
    move *= s.rates
    s.values.sub_(move if s.rows is None else move * s.rows)
