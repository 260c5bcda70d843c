"""Zero-1-to-3 as a prior: one photo of an object and a change of the pose, and it paints what is seen from there.

Liu et al., Zero-1-to-3 (ICCV 2023), with the published weights (`zero123_folder`), 256 x 256. It knows neither the
field's render nor depth: of a `Condition` it takes the photo and the relative pose. Its own code's conventions, all of
them kept (cvlab-columbia/zero123, gradio_new.py and ldm/data/simple.py):

- The pose is (polar angle in radians, sine and cosine of the azimuth, radius), each pose's minus photo's. The polar
  angle is counted from the zenith, so it falls where elevation rises; azimuth runs from x to y in both.
- Radii were between 1.5 and 2.2 sides of the object's box. Ours are over the flying height; a flying height counts as
  the middle of these, `RADIUS`.
- CLIP's eye sees the photo through its own bicubic resampling, corners aligned, without antialiasing.
- The photo's latent, four more channels of the denoiser's input, is the coder's mode and is *not* scaled; what is
  painted is in the scaled space.
- Without a photo: zeros for that latent and for the one token, after the projection.
"""

from pathlib import Path

import numpy as np
import torch
from jaxtyping import Float, Float32
from numpy import ndarray as Array
from torch import Tensor
from torch.nn import functional

from dav_gswt.images import image_files
from dav_gswt.prior import sampler, zero123_folder
from dav_gswt.prior.interface import Condition, Imagined
from dav_gswt.prior.zero123_folder import CODE, Parts

SIZE = 256
LATENT = (CODE, SIZE // 8, SIZE // 8)
GUIDANCE = 3.0  # the authors' choice
RADIUS = 1.85
AS_TRAINED = -1.0, 1.0, 1.0, RADIUS  # times our relative pose gives theirs
MEAN, SPREAD = (0.48145466, 0.4578275, 0.40821073), (0.26862954, 0.26130258, 0.27577711)  # of CLIP's pictures
WHITE = 0.1  # colours nearer to white than this let it shine through
AT_ONCE = 4  # pictures that are coded at a time
BATCH = 8  # latents that are denoised at a time; with guidance each is there twice


class Zero123:
    """A `Prior` from a folder of published weights.

    guidance: how far to go beyond what it would paint without the photo; 1 saves that pass. device: of PyTorch.
    """

    name, size = "zero123", SIZE

    def __init__(self, parts: Parts, guidance: float = GUIDANCE, device: str = "cpu"):
        """Raises: ValueError: a guidance below 1 or not finite."""
        if not 1 <= guidance < float("inf"):
            raise ValueError(f"guidance is {guidance}; it must be at least 1 (none)")
        self.parts, self.guidance, self.device = parts, guidance, device
        for part in (parts.unet, parts.coder, parts.eye, parts.projection):
            part.to(device)

    @classmethod
    def open(cls, folder: Path | str, guidance: float = GUIDANCE, device: str = "cpu") -> "Zero123":
        """Raises: InputError: see zero123_folder.opened. ValueError: see __init__."""
        return cls(zero123_folder.opened(folder), guidance, device)

    def samples(
        self, condition: Condition, m: int, p_drop: float, steps: int, seed: int, common: bool = True
    ) -> Float32[Array, "b m c hz wz"]:
        """See `Prior`. With guidance, a sample has one mask for the passes with and without the photo."""
        condition.check()
        photo, tokens = self._told(condition)

        def denoise(latents: Tensor, time: Tensor, some: slice) -> Tensor:
            each = len(latents) // (some.stop - some.start)
            told = (part[some].repeat_interleave(each, 0) for part in (photo, tokens))
            return self._predicted(latents.to(self.device), time, *told).cpu()

        how = len(condition), LATENT, m, p_drop, steps, seed, BATCH, common
        return sampler.sampled(denoise, self.parts.layers, self.parts.schedule, *how)

    def decoded(self, latents: Float32[Array, "*n c hz wz"]) -> Imagined:
        """See `Prior`. Depth it knows none; opacity is what the white background leaves."""
        flat = torch.from_numpy(np.ascontiguousarray(latents.reshape(-1, *LATENT))).to(self.device)
        scale = self.parts.coder.config.scaling_factor
        with torch.inference_mode():
            made = [self.parts.coder.decode(part / scale).sample.cpu() for part in flat.split(AT_ONCE)]
        painted = ((torch.cat(made) + 1) / 2).clamp(0, 1).numpy().transpose(0, 2, 3, 1)
        return Imagined(without_white(painted).reshape(*latents.shape[:-3], SIZE, SIZE, 4), None)

    def shown(self, condition: Condition) -> Float32[Array, "b c hz wz"]:
        """See `Prior`: the render over white, as its pictures are."""
        over_white = np.clip(condition.colour + (1 - condition.alpha)[..., None], 0, 1)
        coder, parts = self.parts.coder, sized(over_white).to(self.device).split(AT_ONCE)
        with torch.inference_mode():
            made = [coder.encode(2 * part - 1).latent_dist.mode().cpu() for part in parts]
        return (torch.cat(made) * coder.config.scaling_factor).numpy()

    def variances(self, latents: Float32[Array, "*n c hz wz"]) -> Float32[Array, "*n c hz wz"]:
        """See `Prior`."""
        flat = torch.from_numpy(np.ascontiguousarray(latents.reshape(-1, *LATENT))).to(self.device)
        coder, scale = self.parts.coder, self.parts.coder.config.scaling_factor
        with torch.inference_mode():
            painted = (coder.decode(part / scale).sample for part in flat.split(AT_ONCE))
            made = [coder.encode(picture.clamp(-1, 1)).latent_dist.var.cpu() for picture in painted]
        return (torch.cat(made) * scale**2).numpy().reshape(latents.shape)

    def _told(self, condition: Condition) -> tuple[Tensor, Tensor]:
        """The photos' latents, and one token each."""
        photo = sized(condition.photo).to(self.device)
        pose = (torch.from_numpy(condition.relative) * torch.tensor(AS_TRAINED)).to(self.device)
        coder, eye = self.parts.coder, self.parts.eye
        with torch.inference_mode():
            parts = photo.split(AT_ONCE)
            latents = torch.cat([coder.encode(2 * part - 1).latent_dist.mode() for part in parts])
            seen = torch.cat([eye(for_clip(part, eye.config.image_size)).image_embeds for part in parts])
            tokens = self.parts.projection(torch.cat([seen, pose], 1))[:, None]
        return latents, tokens

    def _predicted(
        self, latents: Float[Tensor, "n c h w"], time: Tensor, photo: Float[Tensor, "n c h w"], tokens: Tensor
    ) -> Float[Tensor, "n c h w"]:
        """The denoiser's prediction; with guidance from a batch of all without the photo, then all with it."""
        unet = self.parts.unet
        if self.guidance == 1:
            return unet(torch.cat([latents, photo], 1), time, tokens).sample
        twice = torch.cat([latents, latents]), torch.cat([torch.zeros_like(photo), photo])
        found = unet(torch.cat(twice, 1), time, torch.cat([torch.zeros_like(tokens), tokens])).sample
        alone, told = found.chunk(2)
        return alone + self.guidance * (told - alone)


def sized(photo: Float32[Array, "b s s 3"]) -> Float[Tensor, "b 3 size size"]:
    """Photos of any size as the coder takes them: means over areas of larger ones, smaller ones bicubic."""
    side = photo.shape[1]
    if side > SIZE:
        photo = np.stack([image_files.shrink_image(one, SIZE, SIZE) for one in photo])
    planes = torch.from_numpy(np.ascontiguousarray(photo.transpose(0, 3, 1, 2)))
    if side < SIZE:
        planes = functional.interpolate(planes, (SIZE, SIZE), mode="bicubic", align_corners=False)
    return planes.clamp(0, 1)


def for_clip(photo: Float[Tensor, "b 3 h w"], side: int) -> Float[Tensor, "b 3 side side"]:
    """Photos as CLIP's eye saw them in training."""
    seen = functional.interpolate(photo, (side, side), mode="bicubic", align_corners=True)
    mean, spread = (torch.tensor(values).to(photo)[:, None, None] for values in (MEAN, SPREAD))
    return (seen - mean) / spread


def without_white(painted: Float32[Array, "n h w 3"]) -> Float32[Array, "n h w 4"]:
    """Colours over nothing, and opacity, of pictures on white.

    A colour's distance from white is that of its darkest channel; opacity grows with it and is 1 from WHITE on. The
    white that shines through is taken away, so drawn over white the picture is the same. Light sand is never white
    enough to matter; snow and clouds are, and are lost.
    """
    opacity = np.clip((1 - painted.min(-1, keepdims=True)) / np.float32(WHITE), 0, 1)
    return np.concatenate([painted - (1 - opacity), opacity], -1).astype(np.float32).clip(0, 1)
