"""The published weights of LPIPS v0.1 on AlexNet, which come with the library.

Licences: LPIPS (heads): BSD 2-Clause, Copyright (c) 2018 Richard Zhang, Phillip Isola, Alexei A. Efros, Eli Shechtman,
Oliver Wang. torchvision's AlexNet (trunk): BSD 3-Clause, Copyright (c) Soumith Chintala 2016.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float32
from numpy import ndarray as Array
from safetensors import SafetensorError, safe_open

from dav_gswt.errors import InputError
from dav_gswt.files import UNREADABLE, locate_path

PUBLISHED = Path(__file__).with_name("lpips_alexnet.safetensors")
# outputs, inputs, rows, columns of each convolution
SHAPES = (64, 3, 11, 11), (192, 64, 5, 5), (384, 192, 3, 3), (256, 384, 3, 3), (256, 256, 3, 3)


@dataclass(frozen=True)
class Weights:
    """AlexNet's five convolutions and, for each, how much its channels count (the heads), finest layer first."""

    kernels: tuple[Float32[Array, "_ _ _ _"], ...]
    biases: tuple[Float32[Array, "_"], ...]
    heads: tuple[Float32[Array, "_"], ...]


def locate_weights(lpips: str) -> str:
    """The file that the config's `lpips` means: `installed`, or a path. Raises: InputError: there is no such file."""
    found = PUBLISHED if lpips == "installed" else locate_path(lpips)
    if not found.is_file():
        raise InputError(f"config: lpips: there is no {lpips}; give a .safetensors file, `installed` or `none`")
    return str(found)


def read(path: Path | str) -> Weights:
    """Read weights of this network: kernel0, bias0, head0 and so on.

    Raises: InputError: not readable, or a tensor is missing, of another shape or type, or not finite.
    """
    expected = {f"kernel{i}": shape for i, shape in enumerate(SHAPES)}
    expected |= {f"{name}{i}": shape[:1] for name in ("bias", "head") for i, shape in enumerate(SHAPES)}
    try:
        with safe_open(str(path), "np") as file:
            for name, shape in expected.items():  # before a tensor is read
                part = file.get_slice(name)
                if tuple(part.get_shape()) != shape or part.get_dtype() != "F32":
                    raise InputError(f"{path}: {name} is not of LPIPS on AlexNet; set `lpips: installed`")
            values = {name: file.get_tensor(name) for name in expected}
    except (SafetensorError, *UNREADABLE) as error:
        raise InputError(f"{path}: no weights of LPIPS on AlexNet ({error}); set `lpips: installed`") from error
    if bad := [name for name, value in values.items() if not np.isfinite(value).all()]:
        raise InputError(f"{path}: {bad[0]} holds numbers that are not finite; set `lpips: installed`")
    return Weights(*(tuple(values[f"{name}{i}"] for i in range(5)) for name in ("kernel", "bias", "head")))
