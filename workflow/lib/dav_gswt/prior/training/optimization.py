"""Training of the prior: first the coder of pictures, then the denoiser of their codes (or the regressor).

Every step draws its batch, noise, masks and dropout from the seed and the step's number alone, so a training that was
killed goes on from its checkpoint and ends with the same weights. The weights kept are running means.
"""

import logging
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import torch
from jaxtyping import Float
from safetensors.torch import load_file, save_file
from torch import Tensor, nn

from dav_gswt.files import whole
from dav_gswt.logs import progress
from dav_gswt.prior import dropout
from dav_gswt.prior.networks import CODE, TIMES, Network, schedule

_log = logging.getLogger(__name__)

KEEP = 250  # steps between two checkpoints
WARM = 200  # steps until the full rate
MEAN = 0.998  # of the running mean of weights, at most
DECAY = 0.01  # of the weights
CLIP = 1.0  # longest gradient
DIVERGENCE = 1e-6  # weight of the coder's Kullback-Leibler term: codes stay near a normal distribution
DROPS = 0.3  # greatest attention dropout in training; each batch draws its own share, a third of them none
MASKED = 0.35  # share of examples of which a part of the render is hidden, as where two tiles are joined


@dataclass(frozen=True)
class Plan:
    """How long and how fast. steps; batch: examples a step; rate: of AdamW at its height; seed."""

    steps: int
    batch: int
    rate: float
    seed: int


@dataclass(frozen=True)
class Codes:
    """Examples as the denoiser sees them. relative: see `Condition`."""

    truth: Float[Tensor, "n 8 h w"]
    render: Float[Tensor, "n 8 h w"]
    opacity: Float[Tensor, "n 1 h w"]
    photo: Float[Tensor, "n 8 h w"]
    relative: Float[Tensor, "n 4"]

    def __len__(self) -> int:
        return len(self.truth)


def train(
    part: nn.Module, loss: Callable[[int, torch.Generator], Tensor], plan: Plan, keep: Path, what: str
) -> list[float]:
    """Train a part of a network, in place, to its running mean; returns the loss of every step.

    loss: of a step's number, with that step's random numbers. keep: where the checkpoint lies meanwhile.
    """
    adam = torch.optim.AdamW(part.parameters(), plan.rate, weight_decay=DECAY)
    mean = {name: v.detach().clone() for name, v in part.named_parameters()}
    losses, begun = _resumed(part, adam, mean, keep)
    for step in progress(range(begun, plan.steps), what):
        for group in adam.param_groups:
            group["lr"] = plan.rate * _share(step, plan.steps)
        value = loss(step, torch.Generator().manual_seed(plan.seed * 1_000_003 + step))
        adam.zero_grad()
        value.backward()
        nn.utils.clip_grad_norm_(part.parameters(), CLIP)
        adam.step()
        share = min(MEAN, (1 + step) / (10 + step))
        for name, v in part.named_parameters():
            mean[name].lerp_(v.detach(), 1 - share)
        losses.append(float(value.detach()))
        if (step + 1) % KEEP == 0:
            _keep(part, adam, mean, losses, keep)
    part.load_state_dict(mean, strict=False)
    keep.unlink(missing_ok=True)
    return losses


def train_coder(network: Network, pictures: Tensor, plan: Plan, keep: Path) -> list[float]:
    """Train the coder on pictures (n 5 s s, bytes), then set the scale of its codes.

    Loss: absolute difference, and a little divergence.
    """

    def loss(step: int, rng: torch.Generator) -> Tensor:
        rows = torch.randint(len(pictures), (plan.batch,), generator=rng)
        true = pictures[rows].float() / 255
        posterior = network.posterior(true)
        code = posterior.mean + posterior.std * torch.randn(posterior.mean.shape, generator=rng)
        made = (network.coder.decode(code) + 1) / 2
        return (made - true).abs().mean() + DIVERGENCE * posterior.kl().mean()

    losses = train(network.coder, loss, plan, keep, "train coder")
    network.eval()
    with torch.inference_mode():
        some = pictures[:: max(1, len(pictures) // 2048)].float() / 255
        network.scale.fill_(1 / network.posterior(some).mode().std())
    return losses


def train_denoiser(network: Network, codes: Codes, plan: Plan, keep: Path, regress: bool = False) -> list[float]:
    """Train the denoiser to tell the velocity of noisy codes; regress: to tell the code itself from no noise at all."""
    steps, layers = schedule(), dropout.held(network.denoiser)
    trained = nn.ModuleDict({"denoiser": network.denoiser, "told": network.told})

    def loss(step: int, rng: torch.Generator) -> Tensor:
        rows = torch.randint(len(codes), (plan.batch,), generator=rng)
        truth, noise = codes.truth[rows], torch.randn((plan.batch, *CODE), generator=rng)
        time = torch.randint(TIMES, (plan.batch,), generator=rng)
        known = _known(plan.batch, rng)
        opacity = torch.cat([codes.opacity[rows] * known, known], 1)
        told = codes.render[rows] * known, opacity, network.told(codes.photo[rows], codes.relative[rows])
        drop = DROPS * max(0.0, 1.5 * float(torch.rand((), generator=rng)) - 0.5)
        with dropout.masks(layers, plan.batch, drop, plan.seed * 1_000_003 + step):
            if regress:
                zero = torch.zeros_like(time)
                return (network.denoised(torch.zeros_like(truth), zero, *told) - truth).square().mean()
            noisy, wanted = steps.add_noise(truth, noise, time), steps.get_velocity(truth, noise, time)
            return (network.denoised(noisy, time, *told) - wanted).square().mean()

    return train(trained, loss, plan, keep, "train regressor" if regress else "train denoiser")


def _known(count: int, rng: torch.Generator) -> Float[Tensor, "n 1 h w"]:
    """1 where the render is to be believed: everywhere, or all but a band or a block."""
    known = torch.ones((count, 1, *CODE[1:]))
    side = CODE[1]
    for i in range(count):
        kind, a, b, c, d = torch.rand(5, generator=rng).tolist()
        if kind < MASKED:
            top, left = int(a * side), int(b * side)
            high, wide = (1 + int(v * 0.7 * side) for v in (c, d))
            if kind < MASKED / 2:  # a band right across
                left, wide = 0, side
            known[i, :, top : top + high, left : left + wide] = 0
            if kind < MASKED / 4:
                known[i] = known[i].transpose(1, 2).clone()
    return known


def _share(step: int, steps: int) -> float:
    """Of the rate: it warms up, then falls along a half cosine to a fiftieth."""
    falling = 0.5 * (1 + torch.cos(torch.tensor(torch.pi * step / steps)).item())
    return min(1.0, (step + 1) / WARM) * max(0.02, falling)


def _keep(part: nn.Module, adam: torch.optim.Optimizer, mean: dict[str, Tensor], losses: list[float], path: Path):
    values = {f"part.{name}": v.detach() for name, v in part.named_parameters()}
    values |= {f"mean.{name}": v for name, v in mean.items()}
    for i, state in adam.state_dict()["state"].items():
        values |= {f"adam.{i}.{name}": v for name, v in state.items()}
    values["losses"] = torch.tensor(losses)
    with whole(path) as temporary:
        save_file({name: v.contiguous() for name, v in values.items()}, str(temporary))


def _resumed(part: nn.Module, adam, mean: dict[str, Tensor], path: Path) -> tuple[list[float], int]:
    if not path.exists():
        return [], 0
    values = load_file(str(path))
    part.load_state_dict({name: values[f"part.{name}"] for name, _ in part.named_parameters()}, strict=False)
    for name in mean:
        mean[name].copy_(values[f"mean.{name}"])
    state: dict[int, dict[str, Tensor]] = {}
    for name, value in values.items():
        if name.startswith("adam."):
            _, i, key = name.split(".")
            state.setdefault(int(i), {})[key] = value
    adam.load_state_dict({"state": state, "param_groups": adam.state_dict()["param_groups"]})
    losses = values["losses"].tolist()
    _log.info("training goes on from step %d", len(losses))
    return losses, len(losses)
