"""Maps of candidate poses, all in one .npz file."""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from jaxtyping import Float32
from numpy import ndarray as Array

from dav_gswt.errors import InputError
from dav_gswt.field import GaussianField
from dav_gswt.files import UNREADABLE, atomic_file


@dataclass(frozen=True)
class PoseMaps:
    """Maps of n candidates. opacity: rendered uncertainty (1 - opacity, plus that of the Gaussians in view) of the
    whole picture, NaN below and beside a smaller picture. w2_sq: disagreement of the prior's samples in the picture's
    middle square; None without a prior. cells: pixels that show each cell of the ground (`coverage.CellViews`)."""

    names: list[str]
    opacity: Float32[Array, "n h w"]
    w2_sq: Float32[Array, "n hz wz"] | None
    cells: Float32[Array, "n cells"]


def apply_uncertainty(field: GaussianField, gaussians: Float32[Array, "g"]) -> GaussianField:
    """Replace the uncertainty of a field's first Gaussians. Inpainted ones keep theirs: the maps are older than
    they."""
    uncertainty, n = field.uncertainty.copy(), len(gaussians)
    uncertainty[:n] = np.where(field.imagined[:n], uncertainty[:n], gaussians)
    return replace(field, uncertainty=uncertainty)


def write_pose_maps(path: Path | str, maps: PoseMaps, gaussians: Float32[Array, "g"]) -> None:
    """Write maps (opacity in half precision) and the uncertainty of each Gaussian of the field."""
    values = {"names": np.array(maps.names, str), "opacity": maps.opacity.astype(np.float16), "gaussians": gaussians}
    values["cells"] = maps.cells
    if maps.w2_sq is not None:
        values["w2_sq"] = maps.w2_sq
    with atomic_file(path) as part, part.open("wb") as file:
        np.savez_compressed(file, **values)


def read_pose_maps(path: Path | str) -> tuple[PoseMaps, Float32[Array, "g"]]:
    """Read maps and Gaussians' uncertainty. Raises: InputError: not such a file."""
    try:
        with np.load(path, allow_pickle=False) as stored:
            w2_sq = stored.get("w2_sq")
            names = [str(name) for name in stored["names"]]
            maps = PoseMaps(names, stored["opacity"].astype(np.float32), w2_sq, stored["cells"])
            return maps, stored["gaussians"]
    except UNREADABLE as error:
        raise InputError(f"{path}: not readable as maps of poses ({error}); make it again") from error
