"""The terrain prior, trained by this project: a small latent diffusion model of terrain seen from any side."""

from pathlib import Path

import numpy as np
import torch
from jaxtyping import Bool, Float32
from numpy import ndarray as Array
from torch import Tensor

from dav_gswt.prior import sampler, weights
from dav_gswt.prior.interface import Condition
from dav_gswt.prior.networks import CELL, LATENT, SIZE, Network, make_schedule
from dav_gswt.prior.sampler import Sampling

DEPTH_SCALE = 0.5  # of inverse depth: the plane is 1 at half a flying height, where it is clipped
BATCH = 256  # pictures that are encoded or decoded at a time


class TerrainPrior:
    """The `Prior` of the model in a weights file."""

    name, size, small = "terrain", SIZE, True

    def __init__(self, network: Network):
        # a fifth faster on CPUs, equal but for rounding
        network.denoiser.to(memory_format=torch.channels_last)  # pyright: ignore[reportCallIssue]: torch lacks it
        self.network = network.eval().requires_grad_(False)
        self.layers, self.schedule = sampler.replace_dropout(network.denoiser), make_schedule()

    @classmethod
    def open(cls, path: Path | str) -> "TerrainPrior":
        """Raises: InputError: see weights.load_weights."""
        network = Network()
        weights.load_weights(network, path)
        return cls(network)

    def encode(self, planes: Float32[Tensor, "n 5 s s"]) -> Float32[Tensor, "n c hz wz"]:
        """Latents of pictures; see `pack_render`."""
        with torch.inference_mode():
            return torch.cat([self.network.encode(part) for part in planes.split(BATCH)])

    def decode(self, latents: Float32[Array, "*n c hz wz"]) -> Float32[Array, "*n s s 4"]:
        """See `Prior`."""
        flat = torch.from_numpy(np.ascontiguousarray(latents.reshape(-1, *LATENT)))
        with torch.inference_mode():
            planes = torch.cat([self.network.decode(part) for part in flat.split(BATCH)])
        images = planes.numpy().transpose(0, 2, 3, 1).reshape(*latents.shape[:-3], SIZE, SIZE, -1)
        return np.ascontiguousarray(images[..., :4])

    def sample(
        self,
        condition: Condition,
        m: int,
        p_drop: float,
        steps: int,
        seed: int,
        common: bool = True,
        known: Bool[Array, "b h w"] | None = None,
    ) -> Float32[Array, "b m c hz wz"]:
        """See `Prior`.

        Args:    known: cells of the latent (16 x 16) where the render is valid; None: all.
        Raises:  ValueError: the condition is not finite, see `Condition.check`.
        """
        condition.check()
        render, photo = self.encode(pack_render(condition)), self.encode(pack_photo(condition.photo))
        opacity = average_opacity(torch.from_numpy(condition.alpha))
        valid = torch.ones_like(opacity) if known is None else torch.from_numpy(known).float()[:, None]
        with torch.inference_mode():
            tokens = self.network.condition_encoder(photo, torch.from_numpy(condition.relative))
        inputs = render * valid, torch.cat([opacity * valid, valid], 1), tokens

        def denoise(latents: Tensor, time: Tensor, rows: slice) -> Tensor:
            each = len(latents) // (rows.stop - rows.start)
            return self.network.predict_velocity(
                latents, time, *(part[rows].repeat_interleave(each, 0) for part in inputs)
            )

        sampling = Sampling(m, p_drop, steps, seed, common=common)
        return sampler.sample_latents(denoise, self.layers, self.schedule, len(condition), LATENT, sampling)


def pack_render(condition: Condition) -> Float32[Tensor, "b 5 s s"]:
    """The five planes of the field's render."""
    return pack_truth(np.concatenate([condition.colour, condition.alpha[..., None]], -1), condition.inverse_depth)


def pack_truth(rgba: Float32[Array, "b s s 4"], inverse_depth: Float32[Array, "b s s"]) -> Float32[Tensor, "b 5 s s"]:
    """The five planes of true pictures."""
    planes = np.concatenate([rgba, DEPTH_SCALE * inverse_depth[..., None]], -1)
    return torch.from_numpy(planes.transpose(0, 3, 1, 2).clip(0, 1))


def pack_photo(photo: Float32[Array, "b s s 3"]) -> Float32[Tensor, "b 5 s s"]:
    """The five planes of photos: opaque, of unknown depth."""
    rest = np.broadcast_to(np.array([1.0, 0.0], np.float32), (*photo.shape[:-1], 2))
    return torch.from_numpy(np.concatenate([photo, rest], -1).transpose(0, 3, 1, 2).copy())


def average_opacity(alpha: Float32[Tensor, "b s s"]) -> Float32[Tensor, "b 1 h w"]:
    """Mean opacity in each cell of the latent."""
    return torch.nn.functional.avg_pool2d(alpha[:, None], CELL)
