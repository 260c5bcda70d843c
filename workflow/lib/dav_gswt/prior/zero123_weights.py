"""Published weights of Zero-1-to-3 in a local folder, in either diffusers layout, checked before they are loaded.

Both layouts have unet/, vae/, image_encoder/ and scheduler/; they differ in the folder of the layer that takes in the
pose, and in the names of its weights. Only config.json and one safetensors file are read of each network, and the
config of the scheduler, so no code that comes with the weights is run. Nothing is downloaded.
"""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import torch
from diffusers.models.autoencoders.autoencoder_kl import AutoencoderKL
from diffusers.models.unets.unet_2d_condition import UNet2DConditionModel
from diffusers.schedulers.scheduling_ddim import DDIMScheduler
from torch import nn

from dav_gswt.errors import InputError
from dav_gswt.files import read_json
from dav_gswt.prior import dropout, weights
from dav_gswt.prior.dropout import HeldDropout

Network = Any  # of diffusers or transformers, whose annotations are wrong: a config is no dict, an output no tuple

HELP = "docs/prior.md says how to get the weights"
EXTRA = "transformers==5.23.0"
MOST_BYTES = 8 * 2**30  # of all weights; the published ones are 5 GiB in single precision
PROJECTIONS = {"cc_projection": "projection.", "clip_camera_projection": "proj."}  # folder: prefix of its weights
STEMS = "diffusion_pytorch_model", "model", "pytorch_model"
VARIANTS = "", ".fp16", ".fp16_ema"  # in order of preference
POSE = 4  # numbers of a relative pose
CHANNELS = 4  # of a latent
SCHEDULE = "num_train_timesteps", "beta_start", "beta_end", "beta_schedule"  # all required
LEGACY_NAMES = {"query": "to_q", "key": "to_k", "value": "to_v", "proj_attn": "to_out.0"}  # of old diffusers


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
    clip = _build_network(folder / "image_encoder", _clip_factory())
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
    schedule = _read_schedule(folder / "scheduler" / "scheduler_config.json")
    return Zero123Networks(unet, vae, clip, projection, schedule, dropout.replace_dropout(unet))


def _find_projection(folder: Path) -> str:
    if not folder.is_dir():
        raise InputError(f"{folder}: there is no such folder, and weights are never fetched; {HELP}")
    for name in PROJECTIONS:
        if (folder / name).is_dir():
            return name
    index = folder / "model_index.json"
    found = _read_config(index).get("_class_name", "something else") if index.is_file() else "no model of diffusers"
    either = " or ".join(f"{name}/" for name in PROJECTIONS)
    raise InputError(f"{folder}: holds {found}, not Zero-1-to-3 (it has no {either}); {HELP}")


def _find_weights(folder: Path) -> Path:
    names = [f"{stem}{variant}.safetensors" for variant in VARIANTS for stem in STEMS]
    if found := [folder / name for name in names if (folder / name).is_file()]:
        return found[0]
    if pickles := sorted(p for kind in ("bin", "pt", "pth", "ckpt") for p in folder.glob(f"*.{kind}")):
        raise InputError(f"{pickles[0]}: a pickle could run anything and is not read; convert it, {HELP}")
    raise InputError(f"{folder}: there is no {names[0]} or {names[1]} in it; {HELP}")


def _read_config(path: Path) -> dict[str, Any]:
    values = read_json(path)
    if not isinstance(values, dict):
        raise InputError(f"{path}: describes nothing; copy it again")
    return values


def _clip_factory() -> Callable[[dict[str, Any]], Network]:
    """The function that builds CLIP's image encoder. transformers is imported here: only this prior needs it."""
    try:
        from transformers import CLIPVisionConfig, CLIPVisionModelWithProjection
    except ImportError as error:
        raise InputError(f"the prior zero123 needs transformers: pip install '{EXTRA}' ({error})") from error
    return lambda config: CLIPVisionModelWithProjection(CLIPVisionConfig.from_dict(config))


def _build_network(folder: Path, make: Callable[[dict[str, Any]], Network]) -> Network:
    """Build the network of a config without allocating its weights."""
    path = folder / "config.json"
    config = _read_config(path)
    try:
        with torch.device("meta"):
            return make(config)
    except (TypeError, ValueError, KeyError, AttributeError, RuntimeError, ArithmeticError) as error:
        raise InputError(f"{path}: describes no such network ({error}); copy it again") from error


def _read_schedule(path: Path) -> Any:
    """DDIM on the published schedule, whatever sampler the config names."""
    config = _read_config(path)
    if missing := [key for key in SCHEDULE if key not in config]:
        raise InputError(f"{path}: {missing[0]} is missing; copy it again")
    try:
        return DDIMScheduler.from_config(config, clip_sample=False)
    except (TypeError, ValueError, NotImplementedError, RuntimeError) as error:
        raise InputError(f"{path}: describes no schedule ({error}); copy it again") from error


def _modernize_name(name: str) -> str:
    """The present name of a weight of the VAE: names of its attention have changed in diffusers."""
    if ".attentions." not in name:
        return name
    return ".".join(LEGACY_NAMES.get(part, part) for part in name.split("."))
