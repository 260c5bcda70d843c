"""Zero-1-to-3 as a prior: given one photo of an object and a change of pose, it generates the view from the new pose.

Liu et al., Zero-1-to-3 (ICCV 2023), 256 x 256. It uses neither the field's render nor depth: of a `Condition` it takes
the photo and the relative pose. The published weights are in a local folder, in either diffusers layout: unet/, vae/,
image_encoder/ and a folder of the layer that takes in the pose. Only config.json and one safetensors file are read of
each network, so no code that comes with the weights is run. Nothing is downloaded.

The conventions are those of the authors' code (cvlab-columbia/zero123, gradio_new.py and ldm/data/simple.py):

- The pose is (polar angle in radians, sine and cosine of the azimuth, radius), each relative to the photo's. The polar
  angle is counted from the zenith, so it falls where elevation rises; azimuth runs from x to y in both.
- In training, radii were between 1.5 and 2.2 sides of the object's box. Ours are over the flying height; a flying
  height counts as the middle of that range, `RADIUS`.
- CLIP sees the photo through a bicubic resampling of its own, corners aligned, without antialiasing.
- The photo's latent, four more channels of the denoiser's input, is the mode of the VAE and is *not* scaled; the
  generated latent is in the scaled space.
- Without a photo: zeros for that latent and for the one token, after the projection.
"""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import torch
from diffusers.models.autoencoders.autoencoder_kl import AutoencoderKL
from diffusers.models.unets.unet_2d_condition import UNet2DConditionModel
from diffusers.schedulers.scheduling_ddim import DDIMScheduler
from jaxtyping import Float, Float32
from numpy import ndarray as Array
from torch import Tensor, nn
from torch.nn import functional

from dav_gswt.errors import InputError
from dav_gswt.files import read_json
from dav_gswt.prior import sampler, weights
from dav_gswt.prior.interface import Condition
from dav_gswt.prior.sampler import HeldDropout, Sampling

Network = Any  # of diffusers or transformers, whose annotations are wrong: a config is no dict, an output no tuple

HELP = "docs/prior.md says how to get the weights"
EXTRA = "transformers==5.23.0"
MOST_BYTES = 8 * 2**30  # of all weights; the published ones are 5 GiB in single precision
PROJECTIONS = {"cc_projection": "projection.", "clip_camera_projection": "proj."}  # folder: prefix of its weights
STEMS = "diffusion_pytorch_model", "model", "pytorch_model"
VARIANTS = "", ".fp16", ".fp16_ema"  # in order of preference
POSE = 4  # numbers of a relative pose
CHANNELS = 4  # of a latent
LEGACY_NAMES = {"query": "to_q", "key": "to_k", "value": "to_v", "proj_attn": "to_out.0"}  # of old diffusers
SCHEDULE: dict[str, Any] = {"num_train_timesteps": 1000, "beta_start": 0.00085, "beta_end": 0.012}
SCHEDULE |= {"beta_schedule": "scaled_linear", "clip_sample": False, "set_alpha_to_one": False, "steps_offset": 1}
SIZE = 256
LATENT = (CHANNELS, SIZE // 8, SIZE // 8)
GUIDANCE = 3.0  # the authors' choice
RADIUS = 1.85
POSE_FACTORS = -1.0, 1.0, 1.0, RADIUS  # from our relative pose to that of the training
CLIP_MEAN, CLIP_STD = (0.48145466, 0.4578275, 0.40821073), (0.26862954, 0.26130258, 0.27577711)
WHITE = 0.1  # colours nearer to white than this are partly transparent
VAE_BATCH = 4  # pictures
DENOISER_BATCH = 8  # latents; with guidance each is there twice


@dataclass(frozen=True)
class Zero123Networks:
    """The networks, in single precision on the CPU.

    unet: UNet2DConditionModel. vae: AutoencoderKL. image_encoder: CLIPVisionModelWithProjection. projection: of CLIP's
    embedding and the pose. schedule: DDIMScheduler. layers: dropout behind the attention of `unet`.
    """

    unet: Network
    vae: Network
    image_encoder: Network
    projection: nn.Linear
    schedule: Any
    layers: list[HeldDropout]


class Zero123:
    """A `Prior` from a folder of published weights.

    guidance: of classifier-free guidance; 1 is none and saves a pass.
    """

    name, size, small = "zero123", SIZE, False

    def __init__(self, networks: Zero123Networks, guidance: float = GUIDANCE):
        self.networks, self.guidance = networks, guidance

    @classmethod
    def open(cls, folder: Path | str) -> "Zero123":
        """Raises: InputError: see load_networks."""
        return cls(load_networks(folder))

    def sample(
        self, condition: Condition, m: int, p_drop: float, steps: int, seed: int, common: bool = True
    ) -> Float32[Array, "b m c hz wz"]:
        """See `Prior`. With guidance, a sample has one mask for the passes with and without the photo."""
        condition.check()
        photo, tokens = self._encode_condition(condition)

        def denoise(latents: Tensor, time: Tensor, rows: slice) -> Tensor:
            each = len(latents) // (rows.stop - rows.start)
            inputs = (part[rows].repeat_interleave(each, 0) for part in (photo, tokens))
            return self._predict_noise(latents, time, *inputs)

        sampling = Sampling(m, p_drop, steps, seed, DENOISER_BATCH, common)
        layers, schedule = self.networks.layers, self.networks.schedule
        return sampler.sample_latents(denoise, layers, schedule, len(condition), LATENT, sampling)

    def decode(self, latents: Float32[Array, "*n c hz wz"]) -> Float32[Array, "*n s s 4"]:
        """See `Prior`. Opacity follows from the white background."""
        vae = self.networks.vae
        flat = torch.from_numpy(np.ascontiguousarray(latents.reshape(-1, *LATENT)))
        with torch.inference_mode():
            parts = [vae.decode(part / vae.config.scaling_factor).sample for part in flat.split(VAE_BATCH)]
        pictures = ((torch.cat(parts) + 1) / 2).clamp(0, 1).numpy().transpose(0, 2, 3, 1)
        return remove_white(pictures).reshape(*latents.shape[:-3], SIZE, SIZE, 4)

    def _encode_condition(self, condition: Condition) -> tuple[Tensor, Tensor]:
        """The latents of the photos, and one token each."""
        photo = torch.from_numpy(np.ascontiguousarray(condition.photo.transpose(0, 3, 1, 2)))
        pose = torch.from_numpy(condition.relative) * torch.tensor(POSE_FACTORS)
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


def load_networks(folder: Path | str) -> Zero123Networks:
    """Load the networks in a folder.

    Raises: InputError: there is no such folder or it holds another model; weights are pickles, cut short, missing,
    superfluous, of another shape or type, not finite, or too large altogether, by name; transformers is missing.
    """
    folder = Path(folder)
    projection_folder = _find_projection(folder)
    files = {name: _find_weights(folder / name) for name in ("unet", "vae", "image_encoder", projection_folder)}
    if (size := sum(file.stat().st_size for file in files.values())) > MOST_BYTES:
        raise InputError(f"{folder}: {size / 2**30:.1f} GiB of weights are not those of Zero-1-to-3; {HELP}")
    unet = _build_network(folder / "unet", UNet2DConditionModel.from_config)
    vae = _build_network(folder / "vae", AutoencoderKL.from_config)
    try:  # here: only this prior needs it
        from transformers import CLIPVisionConfig, CLIPVisionModelWithProjection
    except ImportError as error:
        raise InputError(f"the prior zero123 needs transformers: pip install '{EXTRA}' ({error})") from error
    clip = _build_network(
        folder / "image_encoder", lambda config: CLIPVisionModelWithProjection(CLIPVisionConfig.from_dict(config))
    )
    with torch.device("meta"):
        projection = nn.Linear(clip.config.projection_dim + POSE, unet.config.cross_attention_dim)
    prefix = PROJECTIONS[projection_folder]
    weights.fill_weights(projection, files[projection_folder], lambda name: name.removeprefix(prefix), HELP)
    for name, network in (("unet", unet), ("vae", vae), ("image_encoder", clip)):
        weights.fill_weights(network, files[name], _modernize_name if name == "vae" else str, HELP)
    for network in (projection, unet, vae, clip):
        network.eval().requires_grad_(False)
    embeddings = clip.vision_model.embeddings  # its one buffer is not among the weights
    embeddings.position_ids = torch.arange(embeddings.position_ids.shape[-1])[None]
    return Zero123Networks(unet, vae, clip, projection, DDIMScheduler(**SCHEDULE), sampler.replace_dropout(unet))


def _find_projection(folder: Path) -> str:
    if not folder.is_dir():
        raise InputError(f"{folder}: there is no such folder, and weights are never fetched; {HELP}")
    for name in PROJECTIONS:
        if (folder / name).is_dir():
            return name
    either = " or ".join(f"{name}/" for name in PROJECTIONS)
    raise InputError(f"{folder}: is not Zero-1-to-3 (it has no {either}); {HELP}")


def _find_weights(folder: Path) -> Path:
    names = [f"{stem}{variant}.safetensors" for variant in VARIANTS for stem in STEMS]
    if found := [folder / name for name in names if (folder / name).is_file()]:
        return found[0]
    if pickles := sorted(p for kind in ("bin", "pt", "pth", "ckpt") for p in folder.glob(f"*.{kind}")):
        raise InputError(f"{pickles[0]}: a pickle could run anything and is not read; convert it, {HELP}")
    raise InputError(f"{folder}: there is no {names[0]} or {names[1]} in it; {HELP}")


def _build_network(folder: Path, make: Callable[[dict[str, Any]], Network]) -> Network:
    """Build the network of a config without allocating its weights."""
    path = folder / "config.json"
    config = read_json(path)
    try:
        if not isinstance(config, dict):  # diffusers would take a text for the name of a model to fetch
            raise TypeError("it is no object")
        with torch.device("meta"):
            return make(config)
    except (TypeError, ValueError, KeyError, AttributeError, RuntimeError, ArithmeticError) as error:
        raise InputError(f"{path}: describes no such network ({error}); copy it again") from error


def _modernize_name(name: str) -> str:
    """The present name of a weight of the VAE: names of its attention have changed in diffusers."""
    if ".attentions." not in name:
        return name
    return ".".join(LEGACY_NAMES.get(part, part) for part in name.split("."))
