"""From files of examples to weights: the whole training of the prior, or of a regressor to compare it with."""

import json
from dataclasses import dataclass
from pathlib import Path

import torch
from jaxtyping import UInt8
from torch import Tensor

from dav_gswt.prior import weights
from dav_gswt.prior.networks import Network
from dav_gswt.prior.terrain import planes_of_photo, planes_of_render, planes_of_truth, pooled
from dav_gswt.prior.training import examples, optimization
from dav_gswt.prior.training.examples import Examples
from dav_gswt.prior.training.optimization import Codes, Plan

AT_ONCE = 128  # pictures that are coded at a time


@dataclass(frozen=True)
class Pictures:
    """All that is learned from, in bytes to save memory; see `terrain.planes_of_render` for the planes."""

    truth: UInt8[Tensor, "n 5 s s"]
    render: UInt8[Tensor, "n 5 s s"]
    photo: UInt8[Tensor, "n 5 s s"]
    relative: Tensor

    def __len__(self) -> int:
        return len(self.truth)


def learn(
    parts: list[Path | str],
    out: Path | str,
    coder: Plan,
    denoiser: Plan,
    keep: Path,
    coded: Path | str | None = None,
    regress: bool = False,
) -> dict[str, list[float]]:
    """Train on the examples of some files and write the weights; returns the losses of every step, by what was trained.

    keep: a folder for checkpoints. coded: weights whose coder is taken instead of training one. regress: see
    `training.train_denoiser`.
    """
    torch.manual_seed(coder.seed)
    network, pictures = Network(), pictures_of(parts)
    keep.mkdir(parents=True, exist_ok=True)
    losses = {}
    if coded:
        weights.load(network, coded)
        torch.manual_seed(denoiser.seed)
        fresh = Network()
        network.denoiser, network.told = fresh.denoiser, fresh.told
    elif not (done := keep / "coder_done.safetensors").exists():
        mixed = torch.cat([pictures.truth, pictures.render, pictures.photo])
        losses["coder"] = optimization.train_coder(network, mixed, coder, keep / "coder.safetensors")
        weights.save(network, done, {"losses": json.dumps(losses["coder"])}, torch.float32)
    else:
        losses["coder"] = json.loads(weights.load(network, done)["losses"])
    codes = codes_of(network, pictures)
    losses["denoiser"] = optimization.train_denoiser(network, codes, denoiser, keep / "denoiser.safetensors", regress)
    weights.save(network, out, {"examples": str(len(pictures)), "regressor": str(regress)})
    (keep / "coder_done.safetensors").unlink(missing_ok=True)
    return losses


def pictures_of(parts: list[Path | str]) -> Pictures:
    """The pictures of all files, in their order."""
    found = [_bytes(examples.read(part)) for part in parts]
    return Pictures(*(torch.cat(column) for column in zip(*found, strict=True)))


def _bytes(made: Examples) -> tuple[Tensor, Tensor, Tensor, Tensor]:
    planes = (
        planes_of_truth(made.rgba, made.inverse_depth),
        planes_of_render(made.condition),
        planes_of_photo(made.condition.photo),
    )
    return *((255 * p.clamp(0, 1)).round().to(torch.uint8) for p in planes), torch.from_numpy(made.condition.relative)


def codes_of(network: Network, pictures: Pictures) -> Codes:
    """Codes of all pictures, and how opaque the renders are in the codes' cells."""

    def coded(planes: Tensor) -> Tensor:
        with torch.inference_mode():
            return torch.cat([network.encoded(part.float() / 255) for part in planes.split(AT_ONCE)]).clone()

    network.eval()
    opacity = torch.cat([pooled(part[:, 3].float() / 255) for part in pictures.render.split(AT_ONCE)])
    return Codes(coded(pictures.truth), coded(pictures.render), opacity, coded(pictures.photo), pictures.relative)
