"""The state of a fit: the parameters, by the rasterizer's names, and Adam's two moments of each.

Arrays, or tensors on a device; what is added to them and which of them are kept is said by arrays.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Bool, Int
from numpy import ndarray as Array

from dav_gswt import arrays
from dav_gswt.field import GaussianField

NAMES = ("means", "log_scales", "quats", "opacity_logits", "colours")  # colours: spherical harmonics, n k 3


@dataclass
class State:
    """n Gaussians in training; every array or tensor has n rows."""

    values: dict[str, Any]
    first: dict[str, Any]
    second: dict[str, Any]

    def __len__(self) -> int:
        return len(self.values["means"])

    @property
    def sh_degree(self) -> int:
        """Degree of the spherical harmonics."""
        return int(np.sqrt(self.values["colours"].shape[1])) - 1

    def convert(self, change: Callable[[Any], Any]) -> "State":
        """The state of other arrays or tensors, each made of one of these."""
        return State(*({name: change(a) for name, a in part.items()} for part in vars(self).values()))

    def read(self, rows: Int[Array, "m"]) -> dict[str, Array]:
        """The parameters of rows (indices), as arrays of their own."""
        at = arrays.put_beside(rows, self.values["means"])
        return {name: arrays.on_host(a[at]) for name, a in self.values.items()}

    def select(self, rows: Int[Array, "m"]) -> None:
        """Keep these rows (indices), in that order."""
        at = arrays.put_beside(rows, self.values["means"])
        for part in vars(self).values():
            for name in NAMES:
                part[name] = part[name][at]

    def append(self, values: dict[str, Array]) -> None:
        """Add rows; their moments start at zero."""
        for name, before in self.values.items():
            new, join = arrays.put_beside(values[name], before), arrays.namespace(before).concatenate
            self.values[name] = join([before, new])
            for part in (self.first, self.second):
                part[name] = join([part[name], arrays.zeros(new.shape, before)])

    def overwrite(self, rows: Int[Array, "m"], values: dict[str, Array]) -> None:
        """Overwrite some parameters of rows; all moments of theirs start again at zero."""
        at = arrays.put_beside(rows, self.values["means"])
        for name in NAMES:
            if name in values:
                self.values[name][at] = arrays.put_beside(values[name], self.values[name])
            self.first[name][at] = self.second[name][at] = 0

    def resize_sh(self, degree: int) -> None:
        """Change the degree of the spherical harmonics: higher coefficients are dropped, new ones are zero."""
        k = (degree + 1) ** 2
        for part in vars(self).values():
            old = part["colours"]
            part["colours"] = arrays.zeros((len(old), k, 3), old)
            kept = min(k, old.shape[1])
            part["colours"][:, :kept] = old[:, :kept]


def from_field(field: GaussianField) -> State:
    """The state of a field before the first step."""
    arrays = (field.means, field.log_scales, field.quats, field.opacity_logits, field.sh)
    values = {name: np.array(a, np.float32, order="C") for name, a in zip(NAMES, arrays, strict=True)}
    return State(values, *({k: np.zeros_like(v) for k, v in values.items()} for _ in range(2)))


def to_field(state: State, ground: int, keep: Bool[Array, "n"] | None = None) -> GaussianField:
    """The field of a state: its first `ground` Gaussians are discs of the ground; its uncertainty is 0."""
    n, (means, log_scales, quats, logits, sh) = len(state), (state.values[name] for name in NAMES)
    certain = np.zeros(n, np.float32)
    field = GaussianField(means, log_scales, quats, logits, sh, certain, np.arange(n) < ground)
    return field if keep is None else field[keep]
