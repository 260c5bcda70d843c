"""Zero-1-to-3's published weights in a local folder: either diffusers layout, checked before it is loaded.

Both have unet/, vae/, image_encoder/ and scheduler/; they differ in where the layer lies that takes the pose in and in
its weights' names. Of unet/ and the like config.json and one safetensors file are read, of the scheduler its config;
nothing else, so no code that came with the weights is ever run. Nothing here could fetch anything: a folder, no name.
"""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import torch
from diffusers import AutoencoderKL, DDIMScheduler, UNet2DConditionModel
from safetensors import SafetensorError, safe_open
from torch import nn

from dav_gswt.errors import InputError
from dav_gswt.files import read_json
from dav_gswt.prior import dropout
from dav_gswt.prior.dropout import HeldDropout

HELP = "docs/prior.md says how to get the weights"
EXTRA = "transformers==5.23.0"
MOST_BYTES = 8 * 2**30  # of all weights; in single precision the published ones are 5 GiB
PROJECTIONS = {"cc_projection": "projection.", "clip_camera_projection": "proj."}  # folder: prefix of its weights
STEMS = "diffusion_pytorch_model", "model", "pytorch_model"
VARIANTS = "", ".fp16", ".fp16_ema"  # the first that is there
KINDS = {"F64", "F32", "F16", "BF16"}  # what safetensors calls numbers that weights are made of
POSE = 4  # numbers of a relative pose
CODE = 4  # channels of a latent
BLOCKS = 4  # of the coder: 2 ** (BLOCKS - 1) pixels a latent
SCHEDULE = "num_train_timesteps", "beta_start", "beta_end", "beta_schedule"  # no defaults: others would do, wrongly
OLDER = {"query": "to_q", "key": "to_k", "value": "to_v", "proj_attn": "to_out.0"}  # in files of older versions


@dataclass(frozen=True)
class Parts:
    """The networks, in single precision on the CPU. eye: CLIP's. projection: of its embedding and the pose."""

    unet: UNet2DConditionModel
    coder: AutoencoderKL
    eye: nn.Module
    projection: nn.Linear
    schedule: DDIMScheduler
    layers: list[HeldDropout]  # behind the denoiser's attention


def opened(folder: Path | str) -> Parts:
    """The networks in a folder.

    Raises: InputError: no folder, another model's, weights that are pickles, cut short, missing or one too many, of
    another shape or kind, not finite, or too large altogether, by name; transformers is not installed.
    """
    folder = Path(folder)
    place = _projection_in(folder)
    files = {name: _weights_in(folder / name) for name in ("unet", "vae", "image_encoder", place)}
    if (size := sum(file.stat().st_size for file in files.values())) > MOST_BYTES:
        raise InputError(f"{folder}: {size / 2**30:.1f} GiB of weights are not those of Zero-1-to-3; {HELP}")
    unet = _built(folder / "unet", UNet2DConditionModel.from_config)
    coder = _built(folder / "vae", AutoencoderKL.from_config)
    eye = _built(folder / "image_encoder", _eye())
    _require_fitting(folder, unet, coder, eye)
    with torch.device("meta"):
        projection = nn.Linear(eye.config.projection_dim + POSE, unet.config.cross_attention_dim)
    _fill(projection, files[place], lambda name: name.removeprefix(PROJECTIONS[place]))
    _fill(unet, files["unet"])
    _fill(coder, files["vae"], _of_today)
    _fill(eye, files["image_encoder"])
    patches = eye.vision_model.embeddings  # its one buffer is not among the weights
    patches.position_ids = torch.arange(patches.position_ids.shape[-1])[None]
    schedule = _schedule(folder / "scheduler" / "scheduler_config.json")
    return Parts(unet, coder, eye, projection, schedule, dropout.held(unet))


def _projection_in(folder: Path) -> str:
    if not folder.is_dir():
        raise InputError(f"{folder}: there is no such folder, and weights are never fetched; {HELP}")
    for name in PROJECTIONS:
        if (folder / name).is_dir():
            return name
    index = folder / "model_index.json"
    found = _config(index).get("_class_name", "something else") if index.is_file() else "no model of diffusers"
    either = " or ".join(f"{name}/" for name in PROJECTIONS)
    raise InputError(f"{folder}: holds {found}, not Zero-1-to-3 (it has no {either}); {HELP}")


def _weights_in(folder: Path) -> Path:
    names = [f"{stem}{variant}.safetensors" for variant in VARIANTS for stem in STEMS]
    if found := [folder / name for name in names if (folder / name).is_file()]:
        return found[0]
    if pickles := sorted(p for kind in ("bin", "pt", "pth", "ckpt") for p in folder.glob(f"*.{kind}")):
        raise InputError(f"{pickles[0]}: a pickle could run anything and is not read; convert it, {HELP}")
    raise InputError(f"{folder}: there is no {names[0]} or {names[1]} in it; {HELP}")


def _config(path: Path) -> dict:
    values = read_json(path)
    if not isinstance(values, dict):
        raise InputError(f"{path}: describes nothing; copy it again")
    return values


def _eye() -> Callable[[dict], nn.Module]:
    """What builds CLIP's eye; imported here, since only this prior needs it."""
    try:
        from transformers import CLIPVisionConfig, CLIPVisionModelWithProjection
    except ImportError as error:
        raise InputError(f"the prior zero123 needs transformers: pip install '{EXTRA}' ({error})") from error
    return lambda config: CLIPVisionModelWithProjection(CLIPVisionConfig.from_dict(config))


def _built(folder: Path, make: Callable[[dict], nn.Module]) -> nn.Module:
    """The network that a config describes: its shapes only, nothing is allocated."""
    path = folder / "config.json"
    config = _config(path)
    try:
        with torch.device("meta"):
            return make(config)
    except (TypeError, ValueError, KeyError, AttributeError, RuntimeError, ArithmeticError) as error:
        raise InputError(f"{path}: describes no such network ({error}); copy it again") from error


def _require_fitting(folder: Path, unet: UNet2DConditionModel, coder: AutoencoderKL, eye: nn.Module) -> None:
    expected = [
        ("unet", "in_channels", unet.config.in_channels, 2 * CODE),
        ("unet", "out_channels", unet.config.out_channels, CODE),
        ("unet", "cross_attention_dim", unet.config.cross_attention_dim, eye.config.projection_dim),
        ("vae", "in_channels", coder.config.in_channels, 3),
        ("vae", "latent_channels", coder.config.latent_channels, CODE),
        ("vae", "number of block_out_channels", len(coder.config.block_out_channels), BLOCKS),
        ("image_encoder", "num_channels", eye.config.num_channels, 3),
    ]
    for part, what, found, wanted in expected:
        if found != wanted:
            raise InputError(f"{folder / part / 'config.json'}: {what} is {found}, not {wanted}: another model; {HELP}")


def _schedule(path: Path) -> DDIMScheduler:
    """DDIM on the published schedule, whichever sampler the config names."""
    config = _config(path)
    if missing := [key for key in SCHEDULE if key not in config]:
        raise InputError(f"{path}: {missing[0]} is missing; copy it again")
    try:
        return DDIMScheduler.from_config(config, clip_sample=False)
    except (TypeError, ValueError, NotImplementedError, RuntimeError) as error:
        raise InputError(f"{path}: describes no schedule ({error}); copy it again") from error


def _of_today(name: str) -> str:
    """A weight's name as diffusers has it now: the coder's attention had others."""
    if ".attentions." not in name:
        return name
    return ".".join(OLDER.get(part, part) for part in name.split("."))


def _fill(network: nn.Module, path: Path, named: Callable[[str], str] = str) -> None:
    """Put a file's weights into a network without any; names and shapes are compared before a tensor is read.

    named: the network's name for a weight of the file.
    """
    wanted = network.state_dict()
    try:
        with safe_open(str(path), "pt") as file:
            names = _matched(path, set(wanted), list(file.keys()), named)
            for name, value in wanted.items():
                _require_like(path, names[name], file.get_slice(names[name]), tuple(value.shape))
            values = {name: file.get_tensor(names[name]).float() for name in wanted}
    except (SafetensorError, OSError) as error:
        raise InputError(f"{path}: not readable as safetensors ({error}); copy it again") from error
    if bad := [names[name] for name, value in values.items() if not torch.isfinite(value).all()]:
        raise InputError(f"{path}: {bad[0]} holds numbers that are not finite; copy it again")
    network.load_state_dict(values, assign=True)
    network.eval().requires_grad_(False)


def _matched(path: Path, wanted: set[str], found: list[str], named: Callable[[str], str]) -> dict[str, str]:
    """The file's name for every weight of the network."""
    names = {}
    for name in sorted(found):
        if name.endswith("position_ids"):  # older transformers kept this constant among the weights
            continue
        if named(name) not in wanted or named(name) in names:
            raise InputError(f"{path}: {name} is not of this network; {HELP}")
        names[named(name)] = name
    if missing := sorted(wanted - set(names)):
        raise InputError(f"{path}: {missing[0]} is missing; these are the weights of another network; {HELP}")
    return names


def _require_like(path: Path, name: str, header, shape: tuple[int, ...]) -> None:
    if (found := tuple(header.get_shape())) != shape:
        raise InputError(f"{path}: {name} has the shape {found}, not {shape}; {HELP}")
    if (kind := header.get_dtype()) not in KINDS:
        raise InputError(f"{path}: {name} is of the kind {kind}, not floating-point numbers; {HELP}")
