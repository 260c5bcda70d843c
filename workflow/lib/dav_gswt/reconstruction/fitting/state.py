"""The state of a fit: the parameters, by the rasterizer's names, and Adam's two moments of each."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool
from numpy import ndarray as Array

from dav_gswt.field import GaussianField

NAMES = ("means", "log_scales", "quats", "opacity_logits", "colours")  # colours: spherical harmonics, n k 3


@dataclass
class State:
    """n Gaussians in training; every array has n rows."""

    values: dict[str, Array]
    first: dict[str, Array]
    second: dict[str, Array]

    def __len__(self) -> int:
        return len(self.values["means"])

    @property
    def sh_degree(self) -> int:
        """Degree of the spherical harmonics."""
        return int(np.sqrt(self.values["colours"].shape[1])) - 1

    def select(self, rows: Array) -> None:
        """Keep these rows (mask or indices), in that order."""
        for part in vars(self).values():
            for name in NAMES:
                part[name] = np.ascontiguousarray(part[name][rows])

    def append(self, values: dict[str, Array]) -> None:
        """Add rows; their moments start at zero."""
        for name in NAMES:
            self.values[name] = np.concatenate([self.values[name], values[name]])
            for part in (self.first, self.second):
                part[name] = np.concatenate([part[name], np.zeros_like(values[name])])

    def overwrite(self, rows: Array, values: dict[str, Array]) -> None:
        """Overwrite rows; their moments start again at zero."""
        for name in NAMES:
            self.values[name][rows] = values[name]
            self.first[name][rows] = self.second[name][rows] = 0

    def resize_sh(self, degree: int) -> None:
        """Change the degree of the spherical harmonics: higher coefficients are dropped, new ones are zero."""
        k = (degree + 1) ** 2
        for part in vars(self).values():
            old = part["colours"]
            part["colours"] = np.zeros((len(old), k, 3), np.float32)
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
