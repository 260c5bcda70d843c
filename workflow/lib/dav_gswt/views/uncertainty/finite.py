"""Checks of scores, with errors that name the poses."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Bool, Float
from numpy import ndarray as Array

NAMED = 5  # poses named in a message


def reject_poses(bad: Bool[Array, "n"], what: str, names: Sequence[str] | None = None) -> None:
    """Raises: ValueError: any pose is bad; the message names the poses, or their indices without names."""
    if bad.any():
        raise ValueError(f"{what} of pose {format_names(bad, names)}")


def format_names(bad: Bool[Array, "n"], names: Sequence[str] | None = None) -> str:
    """Format the first bad poses by name, or by index without names, and the number of others."""
    found = [names[i] if names is not None else str(i) for i in np.flatnonzero(bad).tolist()]
    more = f" and {len(found) - NAMED} more" if len(found) > NAMED else ""
    return ", ".join(found[:NAMED]) + more


def require_finite(values: Float[Array, "n"], what: str, names: Sequence[str] | None = None) -> None:
    """Raises: ValueError: a value that is NaN or infinite, naming the poses."""
    reject_poses(~np.isfinite(values), f"not finite: {what}", names)
