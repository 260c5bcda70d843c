"""The project's own prior: a small latent diffusion model of terrain seen from any side."""

from pathlib import Path

import numpy as np
import torch
from jaxtyping import Bool, Float32
from numpy import ndarray as Array
from torch import Tensor

from dav_gswt.errors import InputError
from dav_gswt.prior import dropout, sampler, weights
from dav_gswt.prior.interface import Condition, Imagined
from dav_gswt.prior.networks import CODE, SIZE, Network, schedule
from dav_gswt.prior.sampler import Denoise

NEARNESS = 0.5  # of an inverse depth: as a plane it is 1 at half a flying height, and no more
AT_ONCE = 256  # pictures that are coded at a time


class Learned:
    """What the prior and a regressor of its shape share: a network from a file, what it is told, pictures of codes.

    facts: what the file says of its training.
    """

    size = SIZE
    regresses = False  # what a file has to say of itself

    def __init__(self, network: Network, facts: dict[str, str] | None = None):
        network.denoiser.to(
            memory_format=torch.channels_last
        )  # a fifth faster on processors, the same but for rounding
        self.network, self.facts = network.eval().requires_grad_(False), facts or {}
        self.layers = dropout.held(network.denoiser)

    @classmethod
    def open(cls, path: Path | str) -> "Learned":
        """Raises: InputError: see weights.load; or a regressor's weights where the prior's belong, or the reverse."""
        network = Network()
        facts = weights.load(network, path)
        if facts.get("regressor", "False") != str(cls.regresses):
            kinds = ("a regressor", "the prior") if cls.regresses else ("the prior", "a regressor")
            raise InputError(f"{path}: not the weights of {kinds[0]} but of {kinds[1]}; they have the same shape")
        return cls(network, facts)

    def encoded(self, planes: Tensor) -> Float32[Tensor, "n c hz wz"]:
        """Codes of pictures; see `planes_of_render`."""
        with torch.inference_mode():
            return torch.cat([self.network.encoded(part) for part in planes.split(AT_ONCE)])

    def decoded(self, latents: Float32[Array, "*n c hz wz"]) -> Imagined:
        """See `Prior`."""
        flat = torch.from_numpy(np.ascontiguousarray(latents.reshape(-1, *CODE)))
        with torch.inference_mode():
            planes = torch.cat([self.network.decoded(part) for part in flat.split(AT_ONCE)])
        made = planes.numpy().transpose(0, 2, 3, 1).reshape(*latents.shape[:-3], SIZE, SIZE, -1)
        return Imagined(np.ascontiguousarray(made[..., :4]), made[..., 4] / np.float32(NEARNESS))

    def shown(self, condition: Condition) -> Float32[Array, "b c hz wz"]:
        """See `Prior`."""
        return self.encoded(planes_of_render(condition)).numpy()

    def variances(self, latents: Float32[Array, "*n c hz wz"]) -> Float32[Array, "*n c hz wz"]:
        """See `Prior`."""
        flat = torch.from_numpy(np.ascontiguousarray(latents.reshape(-1, *CODE)))
        with torch.inference_mode():
            made = [self.network.posterior(self.network.decoded(part)).var for part in flat.split(AT_ONCE)]
            return (torch.cat(made) * self.network.scale**2).numpy().reshape(latents.shape)

    def told(self, condition: Condition, known: Bool[Array, "b h w"] | None = None) -> Denoise:
        """The denoiser, told of views. known: cells of the code (16 x 16) where the render is to be believed; None:
        all. Raises: ValueError: a condition that is not finite, by name."""
        condition.check()
        render, photo = (self.encoded(p) for p in (planes_of_render(condition), planes_of_photo(condition.photo)))
        opacity = pooled(torch.from_numpy(condition.alpha))
        trusted = torch.ones_like(opacity) if known is None else torch.from_numpy(known).float()[:, None]
        with torch.inference_mode():
            tokens = self.network.told(photo, torch.from_numpy(condition.relative))
        everything = render * trusted, torch.cat([opacity * trusted, trusted], 1), tokens

        def denoise(latents: Tensor, time: Tensor, some: slice) -> Tensor:
            each = len(latents) // (some.stop - some.start)
            told = (part[some].repeat_interleave(each, 0) for part in everything)
            return self.network.denoised(latents, time, *told)

        return denoise


class Terrain(Learned):
    """A `Prior` from a file of weights."""

    name = "terrain"

    def __init__(self, network: Network, facts: dict[str, str] | None = None):
        super().__init__(network, facts)
        self.schedule = schedule()

    def samples(
        self,
        condition: Condition,
        m: int,
        p_drop: float,
        steps: int,
        seed: int,
        known: Bool[Array, "b h w"] | None = None,
        common: bool = True,
    ) -> Float32[Array, "b m c hz wz"]:
        """See `Prior`. known: see `told`. common: one initial noise for all m samples; else each has its own."""
        how = len(condition), CODE, m, p_drop, steps, seed
        return sampler.sampled(self.told(condition, known), self.layers, self.schedule, *how, common=common)

    def repaired(
        self,
        condition: Condition,
        strength: float,
        steps: int,
        seed: int,
        known: Bool[Array, "b h w"] | None = None,
    ) -> Float32[Array, "b c hz wz"]:
        """What the field shows, with a little noise that is then taken away; see `sampler.repaired` and `told`."""
        codes = self.encoded(planes_of_render(condition))
        return sampler.repaired(self.told(condition, known), self.layers, self.schedule, codes, strength, steps, seed)


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
