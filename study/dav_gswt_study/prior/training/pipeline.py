"""The training pipeline: from files of examples to the weights of the prior."""

import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import pandas as pd
import torch
from jaxtyping import Float, UInt8
from torch import Tensor

from dav_gswt.files import atomic_file
from dav_gswt.prior import weights
from dav_gswt.prior.networks import Network
from dav_gswt.prior.terrain import average_opacity, pack_photo, pack_render, pack_truth
from dav_gswt_study.prior.training import example_files, optimization
from dav_gswt_study.prior.training.example_files import Examples
from dav_gswt_study.prior.training.optimization import EncodedExamples, TrainingPlan

BATCH = 128  # pictures that are encoded at a time


@dataclass(frozen=True)
class Pictures:
    """All examples as planes, in bytes to save memory; see `terrain.pack_render`. relative: see `Condition`."""

    truth: UInt8[Tensor, "n 5 s s"]
    render: UInt8[Tensor, "n 5 s s"]
    photo: UInt8[Tensor, "n 5 s s"]
    relative: Float[Tensor, "n 4"]

    def __len__(self) -> int:
        return len(self.truth)


@dataclass(frozen=True)
class Losses:
    """The loss of every step."""

    autoencoder: list[float]
    denoiser: list[float]


def train_prior(
    files: Sequence[Path | str],
    out: Path | str,
    plans: tuple[TrainingPlan, TrainingPlan],
    checkpoints: Path,
) -> Losses:
    """Train on the examples of some files and write the weights.

    Args:    plans: of the autoencoder and of the denoiser. checkpoints: a folder.
    """
    plan, denoiser_plan = plans
    torch.manual_seed(plan.seed)
    network, pictures = Network(), load_pictures(files)
    checkpoints.mkdir(parents=True, exist_ok=True)
    done = checkpoints / "autoencoder_done.safetensors"
    if not done.exists():
        every = torch.cat([pictures.truth, pictures.render, pictures.photo])
        losses = optimization.train_autoencoder(network, every, plan, checkpoints / "autoencoder.safetensors")
        weights.save_weights(network, done, {"losses": json.dumps(losses)}, torch.float32)
    else:
        losses = json.loads(weights.load_weights(network, done)["losses"])
    denoiser_losses = optimization.train_denoiser(
        network, encode_pictures(network, pictures), denoiser_plan, checkpoints / "denoiser.safetensors"
    )
    weights.save_weights(network, out, {"examples": str(len(pictures))})
    done.unlink(missing_ok=True)
    return Losses(losses, denoiser_losses)


def write_losses(path: Path | str, losses: Losses) -> None:
    """Write the loss of every step as CSV: what was trained, step, loss."""
    tables = [
        pd.DataFrame({"trained": name, "step": range(1, len(values) + 1), "loss": values})
        for name, values in (("coder", losses.autoencoder), ("denoiser", losses.denoiser))
    ]
    with atomic_file(path) as part:
        pd.concat(tables).to_csv(part, index=False, float_format="%.5g", lineterminator="\n")


def load_pictures(files: Sequence[Path | str]) -> Pictures:
    """The pictures of all files, in their order."""
    parts = [_to_bytes(example_files.read_examples(file)) for file in files]
    return Pictures(*(torch.cat(column) for column in zip(*parts, strict=True)))


def _to_bytes(examples: Examples) -> tuple[Tensor, Tensor, Tensor, Tensor]:
    condition = examples.condition
    truth, render, photo = (
        (255 * planes.clamp(0, 1)).round().to(torch.uint8)
        for planes in (
            pack_truth(examples.rgba, examples.inverse_depth),
            pack_render(condition),
            pack_photo(condition.photo),
        )
    )
    return truth, render, photo, torch.from_numpy(condition.relative)


def encode_pictures(network: Network, pictures: Pictures) -> EncodedExamples:
    """The latents of all pictures, and the opacity of the renders in the cells of the latents."""

    def encode(planes: Tensor) -> Tensor:
        with torch.inference_mode():
            return torch.cat([network.encode(part.float() / 255) for part in planes.split(BATCH)]).clone()

    network.eval()
    opacity = torch.cat([average_opacity(part[:, 3].float() / 255) for part in pictures.render.split(BATCH)])
    truth, render, photo = (encode(planes) for planes in (pictures.truth, pictures.render, pictures.photo))
    return EncodedExamples(truth, render, opacity, photo, pictures.relative)
