"""Training examples in files: colours and opacities in bytes, everything else in half precision."""

from collections.abc import Sequence
from dataclasses import dataclass, fields
from pathlib import Path

import numpy as np
from jaxtyping import Float32
from numpy import ndarray as Array

from dav_gswt.errors import InputError
from dav_gswt.files import UNREADABLE, atomic_file
from dav_gswt.prior.interface import Condition

SIZE = 64  # pixels per side of an example
SHAPES = {  # of the stored arrays, after the number of examples
    "colour": (SIZE, SIZE, 3),
    "alpha": (SIZE, SIZE),
    "inverse_depth": (SIZE, SIZE),
    "photo": (SIZE, SIZE, 3),
    "relative": (4,),
    "rgba": (SIZE, SIZE, 4),
    "true_inverse_depth": (SIZE, SIZE),
}
IN_BYTES = "colour", "alpha", "photo", "rgba"


@dataclass(frozen=True)
class Examples:
    """n views: the condition, and the truth. rgba: colours over black, and opacity; the sky is transparent.
    inverse_depth: as in Condition."""

    condition: Condition
    rgba: Float32[Array, "n s s 4"]
    inverse_depth: Float32[Array, "n s s"]

    def __len__(self) -> int:
        return len(self.rgba)

    def __getitem__(self, rows) -> "Examples":
        return Examples(self.condition[rows], self.rgba[rows], self.inverse_depth[rows])


def empty_examples() -> Examples:
    """No example."""
    return _from_arrays({name: np.zeros((0, *shape), np.float32) for name, shape in SHAPES.items()})


def concatenate(parts: Sequence[Examples]) -> Examples:
    """The examples of all parts, in their order."""
    arrays = [_to_arrays(part) for part in parts]
    return _from_arrays({name: np.concatenate([a[name] for a in arrays]) for name in SHAPES})


def write_examples(path: Path | str, examples: Examples) -> None:
    """Write examples. Raises: ValueError: see `Condition.check`."""
    if len(examples):
        examples.condition.check()
    with atomic_file(path) as part, part.open("wb") as file:
        arrays = {name: _compress(name, a) for name, a in _to_arrays(examples).items()}
        np.savez_compressed(file, **arrays)  # pyright: ignore[reportArgumentType]: no array is named allow_pickle


def read_examples(path: Path | str) -> Examples:
    """Read what `write_examples` wrote. Raises: InputError: not such a file, or half of one."""
    try:
        with np.load(path, allow_pickle=False) as archive:
            arrays = {name: archive[name] for name in SHAPES}
    except UNREADABLE as error:
        raise InputError(f"{path}: not readable as examples ({error}); make them again") from error
    return _from_arrays({name: _decompress(name, a) for name, a in arrays.items()})


def _to_arrays(examples: Examples) -> dict[str, Array]:
    condition = {f.name: getattr(examples.condition, f.name) for f in fields(Condition)}
    return condition | {"rgba": examples.rgba, "true_inverse_depth": examples.inverse_depth}


def _from_arrays(arrays: dict[str, Array]) -> Examples:
    condition = Condition(**{f.name: arrays[f.name] for f in fields(Condition)})
    return Examples(condition, arrays["rgba"], arrays["true_inverse_depth"])


def _compress(name: str, a: Array) -> Array:
    return np.round(255 * np.clip(a, 0, 1)).astype(np.uint8) if name in IN_BYTES else a.astype(np.float16)


def _decompress(name: str, a: Array) -> Float32[Array, "*shape"]:
    return a.astype(np.float32) / np.float32(255) if name in IN_BYTES else a.astype(np.float32)
