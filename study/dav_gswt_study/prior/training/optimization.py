"""Training of the prior, from files of examples to weights: first the autoencoder, then the denoiser of its latents.

Every step draws its batch, noise, masks and dropout from the seed and the number of the step alone, so an interrupted
training resumes from its checkpoint and ends with the same weights. The final weights are running means.
"""

import json
import logging
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import torch
from diffusers.models.autoencoders.vae import DiagonalGaussianDistribution
from jaxtyping import Float, UInt8
from safetensors.torch import save_file
from torch import Tensor, nn

from dav_gswt.files import atomic_file
from dav_gswt.logs import progress
from dav_gswt.prior import sampler, weights
from dav_gswt.prior.networks import LATENT, TIMES, Network, make_schedule
from dav_gswt.prior.terrain import average_opacity, pack_photo, pack_render, pack_truth
from dav_gswt_study import csv_tables
from dav_gswt_study.prior.training import example_files
from dav_gswt_study.prior.training.example_files import Examples

_log = logging.getLogger(__name__)

BATCH = 128  # pictures that are encoded at a time
CHECKPOINT_STEPS = 250  # between two checkpoints
WARM_UP = 200  # steps until the full learning rate
MEAN_DECAY = 0.998  # of the running mean of weights, at most
WEIGHT_DECAY = 0.01
GRADIENT_NORM = 1.0  # longer gradients are clipped
INITIAL_LOG_VARIANCE = -5.0  # of latents before training
KL_WEIGHT = 1e-6  # of the Kullback-Leibler term of the autoencoder
MOST_DROPOUT = 0.3  # of attention in training; each batch draws its own rate, a third of them none
MASKED = 0.35  # share of examples with a part of the render hidden, as where two tiles are joined


@dataclass(frozen=True)
class TrainingPlan:
    """batch: examples per step. rate: peak learning rate of AdamW."""

    steps: int
    batch: int
    rate: float
    seed: int


@dataclass(frozen=True)
class EncodedExamples:
    """Training examples as latents. opacity: of the render, per cell. relative: see `Condition`."""

    truth: Float[Tensor, "n 8 h w"]
    render: Float[Tensor, "n 8 h w"]
    opacity: Float[Tensor, "n 1 h w"]
    photo: Float[Tensor, "n 8 h w"]
    relative: Float[Tensor, "n 4"]

    def __len__(self) -> int:
        return len(self.truth)


@dataclass(frozen=True)
class Pictures:
    """All examples as planes, in bytes to save memory; see `terrain.pack_render`. relative: see `Condition`."""

    truth: UInt8[Tensor, "n 5 s s"]
    render: UInt8[Tensor, "n 5 s s"]
    photo: UInt8[Tensor, "n 5 s s"]
    relative: Float[Tensor, "n 4"]


def _start_with_small_variances(network: Network) -> None:
    """Give latents INITIAL_LOG_VARIANCE before training, whatever the picture."""
    last = network.autoencoder.encoder[-1]
    assert isinstance(last, nn.Conv2d) and last.bias is not None
    with torch.no_grad():
        last.weight[LATENT[0] :] = 0
        last.bias[LATENT[0] :] = INITIAL_LOG_VARIANCE


def train_autoencoder(
    network: Network, pictures: UInt8[Tensor, "n 5 s s"], plan: TrainingPlan, checkpoint: Path
) -> list[float]:
    """Train the autoencoder on pictures in bytes, then set the scale of its latents; returns the loss of every step.

    Loss: mean absolute error plus KL_WEIGHT times the Kullback-Leibler divergence.
    """

    def loss(step: int, rng: torch.Generator) -> Tensor:
        rows = torch.randint(len(pictures), (plan.batch,), generator=rng)
        true = pictures[rows].float() / 255
        posterior = _find_posterior(network, true)
        latent = posterior.mean + posterior.std * torch.randn(posterior.mean.shape, generator=rng)
        decoded = (network.autoencoder.decoder(latent) + 1) / 2
        return (decoded - true).abs().mean() + KL_WEIGHT * posterior.kl().mean()

    _start_with_small_variances(network)
    losses = train(network.autoencoder, loss, plan, checkpoint, "train autoencoder")
    network.eval()
    with torch.inference_mode():
        some = pictures[:: max(1, len(pictures) // 2048)].float() / 255
        network.scale.fill_(1 / _find_posterior(network, some).mode().std())
    return losses


def _find_posterior(network: Network, planes: Float[Tensor, "n 5 s s"]) -> DiagonalGaussianDistribution:
    """The encoder's normal distribution of unscaled latents of pictures."""
    return DiagonalGaussianDistribution(network.autoencoder.encoder(2 * planes - 1))


def train_denoiser(network: Network, examples: EncodedExamples, plan: TrainingPlan, checkpoint: Path) -> list[float]:
    """Train the denoiser to predict the velocity of noisy latents; returns the loss of every step."""
    schedule, layers = make_schedule(), sampler.replace_dropout(network.denoiser)
    trained = nn.ModuleDict({"denoiser": network.denoiser, "condition_encoder": network.condition_encoder})

    def loss(step: int, rng: torch.Generator) -> Tensor:
        rows = torch.randint(len(examples), (plan.batch,), generator=rng)
        truth, noise = examples.truth[rows], torch.randn((plan.batch, *LATENT), generator=rng)
        time = torch.randint(TIMES, (plan.batch,), generator=rng)
        known = draw_masks(plan.batch, rng)
        opacity = torch.cat([examples.opacity[rows] * known, known], 1)
        tokens = network.condition_encoder(examples.photo[rows], examples.relative[rows])
        inputs = examples.render[rows] * known, opacity, tokens
        p_drop = MOST_DROPOUT * max(0.0, 1.5 * float(torch.rand((), generator=rng)) - 0.5)
        with sampler.hold_masks(layers, plan.batch, p_drop, plan.seed * 1_000_003 + step):
            noisy, velocity = schedule.add_noise(truth, noise, time), schedule.get_velocity(truth, noise, time)
            return (network.predict_velocity(noisy, time, *inputs) - velocity).square().mean()

    return train(trained, loss, plan, checkpoint, "train denoiser")


def draw_masks(count: int, rng: torch.Generator) -> Float[Tensor, "n 1 h w"]:
    """Random masks of the render's valid cells (1): all, or all but a band or a block."""
    known = torch.ones((count, 1, *LATENT[1:]))
    side = LATENT[1]
    for i in range(count):
        kind, a, b, c, d = torch.rand(5, generator=rng).tolist()
        if kind < MASKED:
            top, left = int(a * side), int(b * side)
            height, width = (1 + int(v * 0.7 * side) for v in (c, d))
            if kind < MASKED / 2:  # a band from side to side
                left, width = 0, side
            known[i, :, top : top + height, left : left + width] = 0
            if kind < MASKED / 4:
                known[i] = known[i].transpose(1, 2).clone()
    return known


def train(
    part: nn.Module,
    loss: Callable[[int, torch.Generator], Tensor],
    plan: TrainingPlan,
    checkpoint: Path,
    what: str,
) -> list[float]:
    """Train a part of a network in place, to the running mean of its weights; returns the loss of every step.

    Args:    loss: of the number of a step and that step's random numbers. checkpoint: a file, deleted at the end.
    """
    adam = torch.optim.AdamW(part.parameters(), plan.rate, weight_decay=WEIGHT_DECAY)
    mean = {name: v.detach().clone() for name, v in part.named_parameters()}
    losses = _load_checkpoint(part, adam, mean, checkpoint)
    for step in progress(range(len(losses), plan.steps), what):
        for group in adam.param_groups:
            group["lr"] = plan.rate * _rate_factor(step, plan.steps)
        value = loss(step, torch.Generator().manual_seed(plan.seed * 1_000_003 + step))
        adam.zero_grad()
        value.backward()
        nn.utils.clip_grad_norm_(part.parameters(), GRADIENT_NORM)
        adam.step()
        share = min(MEAN_DECAY, (1 + step) / (10 + step))
        for name, v in part.named_parameters():
            mean[name].lerp_(v.detach(), 1 - share)
        losses.append(float(value.detach()))
        if (step + 1) % CHECKPOINT_STEPS == 0:
            _save_checkpoint(part, adam, mean, losses, checkpoint)
    part.load_state_dict(mean, strict=False)
    checkpoint.unlink(missing_ok=True)
    return losses


def _rate_factor(step: int, steps: int) -> float:
    """Factor of the learning rate: a linear warm-up, then half a cosine down to a fiftieth."""
    falling = 0.5 * (1 + torch.cos(torch.tensor(torch.pi * step / steps)).item())
    return min(1.0, (step + 1) / WARM_UP) * max(0.02, falling)


def _save_checkpoint(
    part: nn.Module, adam: torch.optim.Optimizer, mean: dict[str, Tensor], losses: list[float], path: Path
) -> None:
    state = {"part": part.state_dict(), "mean": mean, "adam": adam.state_dict(), "losses": losses}
    with atomic_file(path) as temporary:
        torch.save(state, temporary)


def _load_checkpoint(part: nn.Module, adam: torch.optim.Optimizer, mean: dict[str, Tensor], path: Path) -> list[float]:
    """Restore a checkpoint, if there is one, in place; returns the losses of the steps that are done."""
    if not path.exists():
        return []
    state = torch.load(path, weights_only=True)
    part.load_state_dict(state["part"])
    adam.load_state_dict(state["adam"])
    mean.update(state["mean"])
    _log.info("training resumes at step %d", len(state["losses"]))
    return state["losses"]


def train_prior(
    files: Sequence[Path | str],
    out: Path | str,
    plans: tuple[TrainingPlan, TrainingPlan],
    checkpoints: Path,
) -> dict[str, list[float]]:
    """Train on the examples of some files and write the weights; returns the loss of every step, by what was trained.

    Args:    plans: of the autoencoder and of the denoiser. checkpoints: a folder.
    """
    plan, denoiser_plan = plans
    torch.manual_seed(plan.seed)
    network, pictures = Network(), load_pictures(files)
    checkpoints.mkdir(parents=True, exist_ok=True)
    done = checkpoints / "autoencoder_done.safetensors"
    if not done.exists():
        every = torch.cat([pictures.truth, pictures.render, pictures.photo])
        losses = train_autoencoder(network, every, plan, checkpoints / "autoencoder.safetensors")
        save_weights(network, done, {"losses": json.dumps(losses)}, torch.float32)
    else:
        losses = json.loads(weights.load_weights(network, done)["losses"])
    denoiser_losses = train_denoiser(
        network, encode_pictures(network, pictures), denoiser_plan, checkpoints / "denoiser.safetensors"
    )
    save_weights(network, out, {"examples": str(len(pictures.truth))})
    done.unlink(missing_ok=True)
    return {"coder": losses, "denoiser": denoiser_losses}


def save_weights(network: Network, path: Path | str, facts: dict[str, str], dtype: torch.dtype = torch.float16) -> None:
    """Write the prior's weights as `weights.load_weights` reads them. facts: metadata for the header."""
    stored = {own: name for name, own in weights.STORED_PARTS.items()}
    values = {}
    for name, value in network.state_dict().items():
        part, dot, rest = name.partition(".")
        values[stored.get(part, part) + dot + rest] = value.detach().to("cpu", dtype).contiguous()
    with atomic_file(path) as unfinished:
        save_file(values, str(unfinished), metadata=facts)


def write_losses(path: Path | str, losses: dict[str, list[float]]) -> None:
    """Write the loss of every step as CSV: what was trained, step, loss."""
    rows = [
        {"trained": name, "step": step, "loss": value}
        for name, values in losses.items()
        for step, value in enumerate(values, 1)
    ]
    csv_tables.write_table(path, rows)


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
