"""Attention dropout with masks of our choice: one mask for a whole trajectory, the same masks for every view.

The attention of diffusers ends in a Dropout that draws a new mask at every step and for every element of a batch. Here
each sample of a view has one mask, drawn from the seed and held for all steps; all views share the masks (common random
numbers), so differences between views are due to the views, and the samples of a view do not depend on its batch.
"""

from contextlib import contextmanager

import torch
from jaxtyping import Float
from torch import Tensor, nn


class HeldDropout(nn.Module):
    """Replaces a Dropout. A batch holds `m` samples of one view, then m of the next, and so on.

    x -> x * mask / (1 - p), with a mask of shape (m, *x.shape[1:]). The identity until `begin` is called.
    """

    def __init__(self, number: int):
        super().__init__()
        self.number = number  # of this layer: each layer draws other masks
        self.m, self.p, self.seed, self.mask = 1, 0.0, 0, None

    def begin(self, m: int, p: float, seed: int) -> None:
        """Forget the mask; the next forward pass draws another."""
        self.m, self.p, self.seed, self.mask = m, p, seed, None

    def forward(self, x: Float[Tensor, "bm *rest"]) -> Float[Tensor, "bm *rest"]:
        """Raises: ValueError: the batch size is not a multiple of m."""
        if self.p == 0:
            return x
        if len(x) % self.m:
            raise ValueError(f"a batch of {len(x)} does not hold whole views of {self.m} samples")
        if self.mask is None or self.mask.shape[1:] != x.shape[1:]:
            self.mask = self._draw_mask(x.shape[1:]).to(x)
        views = x.view(-1, self.m, *x.shape[1:])
        return (views * self.mask).view_as(x)

    def _draw_mask(self, shape: torch.Size) -> Float[Tensor, "m *rest"]:
        generator = torch.Generator().manual_seed((self.seed * 1_000_003 + self.number) % 2**63)
        kept = torch.rand((self.m, *shape), generator=generator) >= self.p
        return kept / (1 - self.p)


def replace_dropout(network: nn.Module) -> list[HeldDropout]:
    """Put a HeldDropout in place of the Dropout behind every attention of a diffusers network.

    Raises: ValueError: the network has no attention.
    """
    layers = []
    for name, part in network.named_modules():
        if name.endswith("to_out") and isinstance(part, nn.ModuleList) and len(part) == 2:
            part[1] = HeldDropout(len(layers))
            layers.append(part[1])
    if not layers:
        raise ValueError("the network has no attention whose output could be dropped out")
    return layers


@contextmanager
def hold_masks(layers: list[HeldDropout], m: int, p: float, seed: int):
    """Hold the masks of one trajectory. Raises: ValueError: p outside [0, 1)."""
    if not 0 <= p < 1:
        raise ValueError(f"p_drop is {p}; it must be at least 0 and less than 1")
    for layer in layers:
        layer.begin(m, p, seed)
    try:
        yield
    finally:
        for layer in layers:
            layer.begin(1, 0.0, 0)
