"""The standard 3DGS PLY of a spool: all columns float32, as readers that know no other type need it."""

from pathlib import Path

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array

from dav_gswt.export.axes import Y_DOWN, turn_points, turn_quats
from dav_gswt.export.spool import Spool
from dav_gswt.files import atomic_file

PROPERTIES = [*("x", "y", "z", "nx", "ny", "nz", "f_dc_0", "f_dc_1", "f_dc_2", "opacity")]
PROPERTIES += [*("scale_0", "scale_1", "scale_2", "rot_0", "rot_1", "rot_2", "rot_3")]
BYTES = 4 * len(PROPERTIES)  # of a Gaussian


def write_ply(spool: Spool, path: Path | str, rotation: Float[Array, "3 3"] = Y_DOWN) -> None:
    """Write Gaussians. rotation: rows of `axes.AXES`."""
    lines = ["ply", "format binary_little_endian 1.0", f"element vertex {len(spool)}"]
    lines += [*(f"property float {name}" for name in PROPERTIES), "end_header"]
    with atomic_file(path) as part, part.open("wb") as file:
        file.write("\n".join(lines).encode() + b"\n")
        for values in spool.read_all():
            means, quats = turn_points(values["means"], rotation), turn_quats(values["quats"], rotation)
            parts = [means, np.zeros_like(means), values["dc"], values["opacity_logits"], values["log_scales"], quats]
            file.write(np.concatenate(parts, axis=1, dtype="<f4").tobytes())
