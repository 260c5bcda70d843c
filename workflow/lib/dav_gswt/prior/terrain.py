"""The project's own prior: a small latent diffusion model of terrain seen from any side."""

from pathlib import Path

import numpy as np
import torch
from jaxtyping import Bool, Float32
from numpy import ndarray as Array
from torch import Tensor

from dav_gswt.prior import dropout, sampler, weights
from dav_gswt.prior.interface import Condition, Imagined
from dav_gswt.prior.networks import CODE, SIZE, Network, schedule

NEARNESS = 0.5  # of an inverse depth: as a plane it is 1 at half a flying height, and no more
AT_ONCE = 256  # pictures that are coded at a time


class Terrain:
    """A `Prior` from a file of weights. facts: what the file says of its training."""

    name, size = "terrain", SIZE

    def __init__(self, network: Network, facts: dict[str, str] | None = None):
        self.network, self.facts = network.eval().requires_grad_(False), facts or {}
        self.layers = dropout.held(network.denoiser)
        self.schedule = schedule()

    @classmethod
    def open(cls, path: Path | str) -> "Terrain":
        """Raises: InputError: see weights.load."""
        network = Network()
        facts = weights.load(network, path)
        return cls(network, facts)

    def samples(
        self,
        condition: Condition,
        m: int,
        p_drop: float,
        steps: int,
        seed: int,
        known: Bool[Array, "b h w"] | None = None,
    ) -> Float32[Array, "b m c hz wz"]:
        """See `Prior`. known: cells of the code (16 x 16) where the render is to be believed; if left out, all."""
        condition.check()
        render, opacity, tokens = self._told(condition)
        trusted = torch.ones_like(opacity) if known is None else torch.from_numpy(known).float()[:, None]
        render, opacity = render * trusted, torch.cat([opacity * trusted, trusted], 1)

        def denoise(latents: Tensor, time: Tensor, some: slice) -> Tensor:
            each = len(latents) // (some.stop - some.start)
            told = (part[some].repeat_interleave(each, 0) for part in (render, opacity, tokens))
            return self.network.denoised(latents, time, *told)

        return sampler.sampled(denoise, self.layers, self.schedule, len(condition), CODE, m, p_drop, steps, seed)

    def decoded(self, latents: Float32[Array, "*n c hz wz"]) -> Imagined:
        """See `Prior`."""
        flat = torch.from_numpy(np.ascontiguousarray(latents.reshape(-1, *CODE)))
        with torch.inference_mode():
            planes = torch.cat([self.network.decoded(part) for part in flat.split(AT_ONCE)])
        made = planes.numpy().transpose(0, 2, 3, 1).reshape(*latents.shape[:-3], SIZE, SIZE, -1)
        return Imagined(np.ascontiguousarray(made[..., :4]), made[..., 4] / np.float32(NEARNESS))

    def _told(self, condition: Condition) -> tuple[Tensor, Tensor, Tensor]:
        """Codes of the render, its opacity in the code's cells, and tokens."""
        with torch.inference_mode():
            render = torch.cat([self.network.encoded(p) for p in planes_of_render(condition).split(AT_ONCE)])
            photo = torch.cat([self.network.encoded(p) for p in planes_of_photo(condition.photo).split(AT_ONCE)])
            tokens = self.network.told(photo, torch.from_numpy(condition.relative))
            return render, pooled(torch.from_numpy(condition.alpha)), tokens


def planes_of_render(condition: Condition) -> Tensor:
    """The five planes of what the field shows."""
    parts = [condition.colour, condition.alpha[..., None], NEARNESS * condition.inverse_depth[..., None]]
    return torch.from_numpy(np.concatenate(parts, -1).transpose(0, 3, 1, 2).clip(0, 1))


def planes_of_truth(rgba: Float32[Array, "b s s 4"], inverse_depth: Float32[Array, "b s s"]) -> Tensor:
    """The five planes of a view as it truly is."""
    return torch.from_numpy(
        np.concatenate([rgba, NEARNESS * inverse_depth[..., None]], -1).transpose(0, 3, 1, 2).clip(0, 1)
    )


def planes_of_photo(photo: Float32[Array, "b s s 3"]) -> Tensor:
    """The five planes of a photo: opaque, of unknown depth."""
    rest = np.broadcast_to(np.float32([1.0, 0.0]), (*photo.shape[:-1], 2))
    return torch.from_numpy(np.concatenate([photo, rest], -1).transpose(0, 3, 1, 2).copy())


def pooled(alpha: Tensor) -> Tensor:
    """Mean opacity in each cell of the code."""
    return torch.nn.functional.avg_pool2d(alpha[:, None], SIZE // CODE[1])
