"""The rasterizer in plain PyTorch, for machines where the C++ core cannot be built. Same pictures, many times slower.

Gaussians are brought onto the screen by the oracle's functions in float64 (which keeps a needle's digits and costs
little) and blended in float32, in squares of 8 x 8 pixels, each with the splats whose box meets it; squares with about
as many splats go together. `backward` blends once more: no picture's intermediate values are kept. Results have the
same bits for the same number of threads.
"""

from dataclasses import dataclass

import numpy as np
import torch
from jaxtyping import Bool, Float, Float32, Int
from numpy import ndarray as Array
from torch import Tensor

from dav_gswt.geometry.cameras import Camera
from dav_gswt.raster import interface, oracle
from dav_gswt.raster.interface import Contributions, Gradients, Rendering
from dav_gswt.raster.oracle import ALPHA_MAX, ALPHA_MIN, CLEAR_MIN, Splats

SIDE = 8  # pixels: smaller squares mean more lists, larger ones more splats that miss most of their square
TOGETHER = 1 << 19  # splats times pixels that are blended at a time: a few MB an intermediate value
NAMES = ("means", "log_scales", "quats", "opacity_logits", "colours", "features")
FARTHEST, STEEPEST = 1e18, 1e12  # pixels, and one over pixels: float32 ends at 3e38


@dataclass(frozen=True)
class Squares:
    """Squares of the picture that are blended together. corners: column and row of their first pixels. rows: which rows
    of the splats' tables are theirs, from front to back; shorter lists are filled with the last row, which is empty."""

    corners: Int[Tensor, "b 2"]
    rows: Int[Tensor, "b length"]


class Rasterizer(interface.Rasterizer):
    """See `interface.Rasterizer`. The number of threads is PyTorch's own (torch.set_num_threads)."""

    def forward(
        self,
        means: Float32[Array, "n 3"],
        log_scales: Float32[Array, "n 3"],
        quats: Float32[Array, "n 4"],
        opacity_logits: Float32[Array, "n"],
        colours: Float32[Array, "n c"] | Float32[Array, "n k 3"],
        camera: Camera,
        features: Float32[Array, "n f"] | None = None,
    ) -> Rendering:
        arrays = dict(zip(NAMES, (means, log_scales, quats, opacity_logits, colours, features), strict=True))
        interface.check_camera(camera)
        interface.check_gaussians(arrays)
        self._last = None
        with torch.no_grad():
            splats, shapes, values = self._on_screen(leaves_of(arrays), camera, None)
            squares = _squares(splats, camera)
            picture = torch.zeros(*_padded(camera), values.shape[1])
            for some in squares:
                _put(picture, some.corners, _weights(shapes[some.rows], some.corners) @ values[some.rows])
        images = apart(picture[: camera.height, : camera.width], colours.shape[-1], features is not None)
        self._last = arrays, camera, images, squares, splats.index
        return Rendering(*images)

    @torch.enable_grad()
    def backward(
        self,
        grad_colour: Float32[Array, "h w c"],
        grad_alpha: Float32[Array, "h w"] | None = None,
        grad_depth: Float32[Array, "h w"] | None = None,
        grad_features: Float32[Array, "h w f"] | None = None,
    ) -> Gradients:
        arrays, camera, images, squares, _ = self._forwarded()
        by_picture = torch.zeros(*_padded(camera), sum(columns_of(i) for i in images))
        by_picture[: camera.height, : camera.width] = together(
            images, (grad_colour, grad_alpha, grad_depth, grad_features)
        )
        leaves = {name: leaf.requires_grad_() for name, leaf in leaves_of(arrays).items()}
        motion = torch.zeros(6, dtype=torch.float64, requires_grad=True)
        _, *tables = self._on_screen(leaves, camera, motion)
        by_tables = [torch.zeros_like(table) for table in tables]
        for some in squares:
            shapes, values = (table.detach()[some.rows].requires_grad_() for table in tables)
            seen = _weights(shapes, some.corners) @ values
            found = torch.autograd.grad(seen, (shapes, values), _taken(by_picture, some.corners))
            for total, part in zip(by_tables, found, strict=True):
                total.index_add_(0, some.rows.flatten(), part.flatten(0, 1))
        found = torch.autograd.grad(tables, (*leaves.values(), motion), by_tables, materialize_grads=True)
        return gradients_of(dict(zip((*leaves, "camera"), found, strict=True)))

    def contributions(self, weights: Float32[Array, "h w c"] | None = None) -> Contributions:
        arrays, camera, _, squares, index = self._forwarded()
        height, width = camera.height, camera.width
        weights = np.empty((height, width, 0), np.float32) if weights is None else weights
        interface.check(weights, "weights", (height, width, interface.columns(weights)))
        maps = torch.zeros(*_padded(camera), 1 + weights.shape[2])
        maps[:height, :width] = torch.as_tensor(np.concatenate([np.ones((height, width, 1), np.float32), weights], 2))
        with torch.no_grad():
            _, shapes, _ = self._on_screen(leaves_of(arrays), camera, None)
            sums = torch.zeros(len(shapes), maps.shape[2])
            squared, most = torch.zeros(2, len(shapes))
            for some in squares:
                at, w = some.rows.flatten(), _weights(shapes[some.rows], some.corners)
                w = w * _taken(maps[..., :1], some.corners)  # what lies beyond the picture's rim counts for nothing
                sums.index_add_(0, at, (w.mT @ _taken(maps, some.corners)).flatten(0, 1))
                squared.index_add_(0, at, (w * w).sum(1).flatten())
                most.scatter_reduce_(0, at, w.amax(1).flatten(), "amax")
        found = torch.zeros(len(arrays["means"]), maps.shape[2] + 2)
        found[index] = torch.cat([sums, squared[:, None], most[:, None]], 1)[:-1]
        return Contributions(*(np.ascontiguousarray(found[:, i]) for i in (0, -2, -1, slice(1, -2))))

    @property
    def drawn(self) -> Bool[Array, "n"]:
        arrays, _, _, squares, index = self._forwarded()
        drawn = np.zeros(len(arrays["means"]) + 1, bool)
        where = torch.cat([index, torch.tensor([len(drawn) - 1])])
        for some in squares:
            drawn[where[some.rows.flatten()].numpy()] = True
        return drawn[:-1]

    def _on_screen(self, leaves: dict[str, Tensor], camera: Camera, motion: Float[Tensor, "6"] | None):
        """The splats, and what blending needs of them as tables of float32 with an empty row below: centre, root and
        opacity; colours, 1, depth and features."""
        view = oracle.moved(camera, motion, leaves["means"])
        features = leaves.get("features")
        given = {name: leaf for name, leaf in leaves.items() if name != "features"}
        splats = oracle.project(
            **given, camera=camera, view=view, near=self.near, dilation=self.dilation, antialiased=self.antialiased
        )
        root = splats.roots.flatten(1)[:, [0, 1, 3]].clamp(-STEEPEST, STEEPEST)
        shapes = torch.cat([splats.centres.clamp(-FARTHEST, FARTHEST), root, splats.opacity[:, None]], 1)
        values = [splats.colours, torch.ones_like(splats.depth)[:, None], splats.depth[:, None]]
        values = torch.cat(values if features is None else [*values, features[splats.index]], 1)
        return splats, *(torch.nn.functional.pad(table, (0, 0, 0, 1)).float() for table in (shapes, values))


def leaves_of(arrays: dict[str, Array | None]) -> dict[str, Tensor]:
    """Gaussians as tensors of float64; features only if there are any."""
    return {name: torch.as_tensor(array).double() for name, array in arrays.items() if array is not None}


def columns_of(image: Array) -> int:
    return image.shape[2] if image.ndim == 3 else 1


def apart(picture: Float[Tensor, "h w c"], colours: int, features: bool) -> tuple[Float32[Array, "..."], ...]:
    """Colour, alpha, depth and perhaps features, read-only, from the channels of one picture in this order."""
    picture = picture.detach().cpu().numpy()
    parts = [picture[..., :colours], picture[..., colours], picture[..., colours + 1], picture[..., colours + 2 :]]
    images = tuple(np.ascontiguousarray(part) for part in parts[: 4 if features else 3])
    for image in images:  # as the core's, whose backward reads them
        image.flags.writeable = False
    return images


def together(images: tuple[Array, ...], gradients: tuple[Array | None, ...]) -> Float[Tensor, "h w c"]:
    """The gradients by colour, alpha, depth and features as those by one picture's channels.

    Raises: ValueError: one does not fit its image, or is of features that were not drawn.
    """
    names = ("colour", "alpha", "depth", "features")
    if gradients[3] is not None and len(images) < 4:
        raise ValueError("grad_features is given, but forward was given no features")
    for name, value, image in zip(names, gradients, images, strict=False):
        if value is not None:
            interface.check(value, f"grad_{name}", image.shape)
    whole = [np.zeros_like(i) if g is None else g for i, g in zip(images, gradients, strict=False)]
    return torch.as_tensor(np.concatenate([w.reshape(*w.shape[:2], -1) for w in whole], 2))


def gradients_of(found: dict[str, Tensor]) -> Gradients:
    arrays = {name: np.ascontiguousarray(g.detach().cpu().numpy(), np.float32) for name, g in found.items()}
    return Gradients(**({"features": None} | arrays))


def _padded(camera: Camera) -> tuple[int, int]:
    """Rows and columns of a picture of whole squares."""
    return -(-camera.height // SIDE) * SIDE, -(-camera.width // SIDE) * SIDE


def _by_squares(picture: Float[Tensor, "h w c"]) -> Float[Tensor, "rows columns side side c"]:
    return picture.unflatten(1, (-1, SIDE)).unflatten(0, (-1, SIDE)).transpose(1, 2)


def _put(picture: Float[Tensor, "h w c"], corners: Int[Tensor, "b 2"], seen: Float[Tensor, "b pixels c"]) -> None:
    column, row = (corners // SIDE).unbind(1)
    _by_squares(picture)[row, column] = seen.unflatten(1, (SIDE, SIDE))


def _taken(picture: Float[Tensor, "h w c"], corners: Int[Tensor, "b 2"]) -> Float[Tensor, "b pixels c"]:
    column, row = (corners // SIDE).unbind(1)
    return _by_squares(picture)[row, column].flatten(1, 2)


def _weights(shapes: Float32[Tensor, "b length 6"], corners: Int[Tensor, "b 2"]) -> Float32[Tensor, "b pixels length"]:
    """Blend weights in some squares; `oracle.weights` says what they are."""
    x, y, r00, r01, r11, opacity = shapes[:, None].unbind(-1)
    steps = torch.arange(SIDE) + 0.5
    dx, dy = (corners[:, i, None, None] + steps[:, None] - c for i, c in ((0, x), (1, y)))
    across = (r00 * dx)[:, None] + (r01 * dy)[:, :, None]
    exponent = across * across + ((r11 * dy) ** 2)[:, :, None]
    alpha = (opacity[:, None] * torch.exp(-0.5 * exponent)).flatten(1, 2)
    alpha = torch.where(alpha < ALPHA_MIN, 0, alpha.clamp(max=ALPHA_MAX))
    clear = torch.cumprod(1 - alpha, 2)
    before = torch.cat([torch.ones_like(clear[..., :1]), clear[..., :-1]], 2)
    return torch.where(clear >= CLEAR_MIN, alpha * before, 0)


def _squares(splats: Splats, camera: Camera) -> list[Squares]:
    """The squares of the picture that splats meet, in groups of about as many splats."""
    low, high = (bound // SIDE for bound in _boxes(splats, camera))
    size = (high - low + 1).clamp(min=0)
    count = size.prod(1)
    rows = torch.repeat_interleave(torch.arange(len(count)), count)
    nth = torch.arange(len(rows)) - (torch.cumsum(count, 0) - count)[rows]
    width = _padded(camera)[1] // SIDE
    square = (low[rows, 1] + nth // size[rows, 0]) * width + low[rows, 0] + nth % size[rows, 0]
    rows = rows[torch.argsort(square, stable=True)]  # stable: from front to back in each square
    lengths = torch.bincount(square)
    first = torch.cumsum(lengths, 0) - lengths
    order = torch.argsort(lengths, descending=True, stable=True)
    order = order[: int((lengths > 0).sum())]
    groups, done = [], 0
    while done < len(order):
        longest = int(lengths[order[done]])
        some = order[done : done + max(1, TOGETHER // (longest * SIDE * SIDE))]
        place = torch.arange(longest)
        at = (first[some, None] + place).clamp(max=len(rows) - 1)
        theirs = torch.where(place < lengths[some, None], rows[at], len(count))
        groups.append(Squares(torch.stack([some % width, some // width], 1) * SIDE, theirs))
        done += len(some)
    return groups


def _boxes(splats: Splats, camera: Camera) -> tuple[Int[Tensor, "m 2"], Int[Tensor, "m 2"]]:
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


def loss(
    image: Float32[Array, "h w c"],
    target: Float32[Array, "h w c"],
    weight: Float32[Array, "h w"] | None = None,
    structure: float = 0.2,
    threads: int | None = None,
) -> tuple[float, Float32[Array, "h w c"]]:
    """See `cpu.loss`; in float64, by autograd."""
    return loss_on(torch.device("cpu"), image, target, weight, structure)


@torch.enable_grad()
def loss_on(device: torch.device, image, target, weight, structure: float) -> tuple[float, Float32[Array, "h w c"]]:
    """`loss`, computed on a device."""
    interface.check(image, "image", (*image.shape[:2], interface.columns(image)))
    interface.check(target, "target", image.shape)
    if weight is None:
        weight = np.ones(image.shape[:2], np.float32)
    interface.check(weight, "weight", image.shape[:2])
    x, y, w = (torch.as_tensor(a).to(device, torch.float64) for a in (image, target, weight[..., None]))
    x.requires_grad_()
    n = _local(w)
    mean = torch.stack([_local(w * f) / torch.where(n > 0, n, 1) for f in (x, y, x * x, y * y, x * y)])
    a, b = mean[0], mean[1]
    vaa, vbb, vab = mean[2] - a * a, mean[3] - b * b, mean[4] - a * b
    c1, c2 = 0.01**2, 0.03**2
    ssim = (2 * a * b + c1) * (2 * vab + c2) / ((a * a + b * b + c1) * (vaa + vbb + c2))
    value = (w * ((1 - structure) * (x - y).abs() + structure * (1 - ssim))).mean()
    (gradient,) = torch.autograd.grad(value, x)
    return value.item(), np.ascontiguousarray(gradient.cpu().numpy(), np.float32)


def _local(values: Float[Tensor, "h w c"]) -> Float[Tensor, "h w c"]:
    """Sums over each pixel's window of 11 x 11, weighted by a Gaussian of sigma 1.5."""
    taps = torch.exp(-((torch.arange(11, dtype=torch.float64) - 5) ** 2) / (2 * 1.5**2)).to(values)
    taps = taps / taps.sum()
    planes = values.permute(2, 0, 1)[:, None]
    planes = torch.nn.functional.conv2d(planes, taps.reshape(1, 1, 11, 1), padding=(5, 0))
    return torch.nn.functional.conv2d(planes, taps.reshape(1, 1, 1, 11), padding=(0, 5))[:, 0].permute(1, 2, 0)


def adam(
    values: Float32[Array, "n ..."],
    gradient: Float32[Array, "n ..."],
    first: Float32[Array, "n ..."],
    second: Float32[Array, "n ..."],
    rate: float | Float32[Array, "columns"],
    step: int,
    betas: tuple[float, float] = (0.9, 0.999),
    epsilon: float = 1e-15,
    rows: Bool[Array, "n"] | None = None,
    threads: int | None = None,
) -> None:
    """See `cpu.adam`; NumPy does it."""
    if step < 1:
        raise ValueError(f"step counts from 1, not {step}")
    for name, array in (("values", values), ("gradient", gradient), ("first", first), ("second", second)):
        interface.check(array, name, values.shape)
        if array is not gradient and not array.flags.writeable:
            raise ValueError(f"{name} is read-only, but is to be changed in place")
    if rows is not None:
        interface.check(rows, "rows", values.shape[:1], np.bool_)
    which = slice(None) if rows is None else np.flatnonzero(rows)
    value, g, m, v = (a.reshape(len(a), -1)[which] for a in (values, gradient, first, second))
    m = betas[0] * m + np.float32(1 - betas[0]) * g
    v = betas[1] * v + np.float32(1 - betas[1]) * (g * g)
    move = np.float32(1 / (1 - betas[0] ** step)) * m
    move /= np.sqrt(np.float32(1 / (1 - betas[1] ** step)) * v) + np.float32(epsilon)
    for array, new in ((values, value - np.asarray(rate, np.float32) * move), (first, m), (second, v)):
        array.reshape(len(array), -1)[which] = new
