"""Zero-1-to-3 as a prior: given one photo of an object and a change of pose, it generates the view from the new pose.

Liu et al., Zero-1-to-3 (ICCV 2023), with the published weights (`zero123_weights`), 256 x 256. It uses neither the
field's render nor depth: of a `Condition` it takes the photo and the relative pose. The conventions are those of the
authors' code (cvlab-columbia/zero123, gradio_new.py and ldm/data/simple.py):

- The pose is (polar angle in radians, sine and cosine of the azimuth, radius), each relative to the photo's. The polar
  angle is counted from the zenith, so it falls where elevation rises; azimuth runs from x to y in both.
- In training, radii were between 1.5 and 2.2 sides of the object's box. Ours are over the flying height; a flying
  height counts as the middle of that range, `RADIUS`.
- CLIP sees the photo through a bicubic resampling of its own, corners aligned, without antialiasing.
- The photo's latent, four more channels of the denoiser's input, is the mode of the VAE and is *not* scaled; the
  generated latent is in the scaled space.
- Without a photo: zeros for that latent and for the one token, after the projection.
"""

from pathlib import Path

import numpy as np
import torch
from jaxtyping import Float, Float32
from numpy import ndarray as Array
from torch import Tensor
from torch.nn import functional

from dav_gswt.prior import sampler, zero123_weights
from dav_gswt.prior.interface import Condition, DecodedViews
from dav_gswt.prior.sampler import Sampling
from dav_gswt.prior.zero123_weights import CHANNELS, Zero123Networks

SIZE = 256
LATENT = (CHANNELS, SIZE // 8, SIZE // 8)
GUIDANCE = 3.0  # the authors' choice
RADIUS = 1.85
POSE_FACTORS = -1.0, 1.0, 1.0, RADIUS  # from our relative pose to that of the training
CLIP_MEAN, CLIP_STD = (0.48145466, 0.4578275, 0.40821073), (0.26862954, 0.26130258, 0.27577711)
WHITE = 0.1  # colours nearer to white than this are partly transparent
VAE_BATCH = 4  # pictures
DENOISER_BATCH = 8  # latents; with guidance each is there twice


class Zero123:
    """A `Prior` from a folder of published weights.

    guidance: of classifier-free guidance; 1 is none and saves a pass. device: of PyTorch.
    """

    name, size = "zero123", SIZE

    def __init__(self, networks: Zero123Networks, guidance: float = GUIDANCE, device: str = "cpu"):
        """Raises: ValueError: a guidance below 1 or not finite."""
        if not 1 <= guidance < float("inf"):
            raise ValueError(f"guidance is {guidance}; it must be at least 1 (none)")
        self.networks, self.guidance, self.device = networks, guidance, device
        for network in (networks.unet, networks.vae, networks.image_encoder, networks.projection):
            network.to(device)

    @classmethod
    def open(cls, folder: Path | str, guidance: float = GUIDANCE, device: str = "cpu") -> "Zero123":
        """Raises: InputError: see zero123_weights.load_networks. ValueError: see __init__."""
        return cls(zero123_weights.load_networks(folder), guidance, device)

    def sample(
        self, condition: Condition, m: int, p_drop: float, steps: int, seed: int, common: bool = True
    ) -> Float32[Array, "b m c hz wz"]:
        """See `Prior`. With guidance, a sample has one mask for the passes with and without the photo."""
        condition.check()
        photo, tokens = self._encode_condition(condition)

        def denoise(latents: Tensor, time: Tensor, rows: slice) -> Tensor:
            each = len(latents) // (rows.stop - rows.start)
            inputs = (part[rows].repeat_interleave(each, 0) for part in (photo, tokens))
            return self._predict_noise(latents.to(self.device), time, *inputs).cpu()

        sampling = Sampling(m, p_drop, steps, seed, DENOISER_BATCH, common)
        layers, schedule = self.networks.layers, self.networks.schedule
        return sampler.sample_latents(denoise, layers, schedule, len(condition), LATENT, sampling)

    def decode(self, latents: Float32[Array, "*n c hz wz"]) -> DecodedViews:
        """See `Prior`. There is no depth; opacity follows from the white background."""
        vae = self.networks.vae
        with torch.inference_mode():
            parts = [vae.decode(part / vae.config.scaling_factor).sample.cpu() for part in self._split(latents)]
        pictures = ((torch.cat(parts) + 1) / 2).clamp(0, 1).numpy().transpose(0, 2, 3, 1)
        return DecodedViews(remove_white(pictures).reshape(*latents.shape[:-3], SIZE, SIZE, 4), None)

    def encode_render(self, condition: Condition) -> Float32[Array, "b c hz wz"]:
        """See `Prior`: the render over white, the background of its pictures."""
        over_white = np.clip(condition.colour + (1 - condition.alpha)[..., None], 0, 1)
        vae, parts = self.networks.vae, _to_tensor(over_white).to(self.device).split(VAE_BATCH)
        with torch.inference_mode():
            modes = [vae.encode(2 * part - 1).latent_dist.mode().cpu() for part in parts]
        return (torch.cat(modes) * vae.config.scaling_factor).numpy()

    def estimate_variances(self, latents: Float32[Array, "*n c hz wz"]) -> Float32[Array, "*n c hz wz"]:
        """See `Prior`."""
        vae = self.networks.vae
        scale = vae.config.scaling_factor
        with torch.inference_mode():
            pictures = (vae.decode(part / scale).sample for part in self._split(latents))
            parts = [vae.encode(picture.clamp(-1, 1)).latent_dist.var.cpu() for picture in pictures]
        return (torch.cat(parts) * scale**2).numpy().reshape(latents.shape)

    def _split(self, latents: Float32[Array, "*n c hz wz"]) -> tuple[Tensor, ...]:
        flat = torch.from_numpy(np.ascontiguousarray(latents.reshape(-1, *LATENT))).to(self.device)
        return flat.split(VAE_BATCH)

    def _encode_condition(self, condition: Condition) -> tuple[Tensor, Tensor]:
        """The latents of the photos, and one token each."""
        photo = _to_tensor(condition.photo).to(self.device)
        pose = (torch.from_numpy(condition.relative) * torch.tensor(POSE_FACTORS)).to(self.device)
        vae, clip = self.networks.vae, self.networks.image_encoder
        with torch.inference_mode():
            parts = photo.split(VAE_BATCH)
            latents = torch.cat([vae.encode(2 * part - 1).latent_dist.mode() for part in parts])
            embeddings = [clip(preprocess_for_clip(part, clip.config.image_size)).image_embeds for part in parts]
            tokens = self.networks.projection(torch.cat([torch.cat(embeddings), pose], 1))[:, None]
        return latents, tokens

    def _predict_noise(
        self, latents: Float[Tensor, "n c h w"], time: Tensor, photo: Float[Tensor, "n c h w"], tokens: Tensor
    ) -> Float[Tensor, "n c h w"]:
        """The denoiser's prediction; with guidance from one batch: all without the photo, then all with it."""
        unet = self.networks.unet
        if self.guidance == 1:
            return unet(torch.cat([latents, photo], 1), time, tokens).sample
        twice = torch.cat([latents, latents]), torch.cat([torch.zeros_like(photo), photo])
        both = unet(torch.cat(twice, 1), time, torch.cat([torch.zeros_like(tokens), tokens])).sample
        without, conditional = both.chunk(2)
        return without + self.guidance * (conditional - without)


def _to_tensor(pictures: Float32[Array, "b s s 3"]) -> Float[Tensor, "b 3 s s"]:
    return torch.from_numpy(np.ascontiguousarray(pictures.transpose(0, 3, 1, 2)))


def preprocess_for_clip(photo: Float[Tensor, "b 3 h w"], side: int) -> Float[Tensor, "b 3 side side"]:
    """Photos as CLIP saw them in the training of Zero-1-to-3."""
    resized = functional.interpolate(photo, (side, side), mode="bicubic", align_corners=True)
    mean, std = (torch.tensor(values).to(photo)[:, None, None] for values in (CLIP_MEAN, CLIP_STD))
    return (resized - mean) / std


def remove_white(pictures: Float32[Array, "n h w 3"]) -> Float32[Array, "n h w 4"]:
    """Colours over black, and opacity, of pictures on a white background.

    The distance of a colour from white is that of its darkest channel; opacity grows with it and is 1 from WHITE on.
    The white that shows through is subtracted, so the result over white is the picture. Snow and clouds are lost.
    """
    opacity = np.clip((1 - pictures.min(-1, keepdims=True)) / np.float32(WHITE), 0, 1)
    return np.concatenate([pictures - (1 - opacity), opacity], -1).astype(np.float32).clip(0, 1)
