"""Gaussians on disk, a file a column, while other programs' files are made of them in parts: memory stays bounded."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
from jaxtyping import Float32
from numpy import ndarray as Array

from dav_gswt.field import GaussianField

COLUMNS = {"means": 3, "dc": 3, "opacity_logits": 1, "log_scales": 3, "quats": 4}  # float32 each
BYTES = 4 * sum(COLUMNS.values())  # of a Gaussian
CHUNK = 262_144  # Gaussians that are read at once


class Spool:
    """Gaussians whose colours do not depend on the view, in our axes.

    Written once, part by part; each column can then be read any number of times. It is the owner's task to remove the
    folder.
    """

    def __init__(self, folder: Path | str):
        self.folder, self.count = Path(folder), 0
        self.folder.mkdir(parents=True)
        self._files = {name: (self.folder / name).open("wb") for name in COLUMNS}

    def __enter__(self) -> "Spool":
        return self

    def __exit__(self, *_) -> None:
        for file in self._files.values():
            file.close()

    def __len__(self) -> int:
        return self.count

    def append(self, field: GaussianField) -> None:
        """Add Gaussians. Raises: ValueError: their colours depend on the view."""
        if field.sh_degree:
            raise ValueError("a spool holds colours of degree 0")
        values = {"dc": field.sh[:, 0]} | {name: getattr(field, name) for name in COLUMNS if name != "dc"}
        for name, file in self._files.items():
            file.write(np.ascontiguousarray(values[name], "<f4").tobytes())
        self.count += len(field)

    def close(self) -> None:
        """End writing; reading needs it."""
        self.__exit__()

    def read(self, column: str) -> Iterator[Float32[Array, "n k"]]:
        """A column in parts, in the order of writing."""
        width = COLUMNS[column]
        with (self.folder / column).open("rb") as file:
            while len(values := np.fromfile(file, "<f4", CHUNK * width)):
                yield values.reshape(-1, width)

    def read_all(self) -> Iterator[dict[str, Float32[Array, "n k"]]]:
        """All columns side by side, in parts."""
        for values in zip(*(self.read(name) for name in COLUMNS), strict=True):
            yield dict(zip(COLUMNS, values, strict=True))
