"""Weights in safetensors files: names, shapes and types are compared before a tensor is read. No pickle is opened."""

from collections.abc import Callable
from pathlib import Path

import torch
from safetensors import SafetensorError, safe_open
from torch import nn

from dav_gswt.errors import InputError, summarize_error
from dav_gswt.files import UNREADABLE

TERRAIN_WEIGHTS = Path(__file__).with_name("terrain.safetensors")  # they come with the library
MOST_BYTES = 256 * 2**20  # of the terrain prior
FLOAT_TYPES = {"F64", "F32", "F16", "BF16"}  # as safetensors names them
STORED_PARTS = {"coder": "autoencoder", "told": "condition_encoder"}  # of a network, in names of the file -> ours


def load_weights(network: nn.Module, path: Path | str) -> dict[str, str]:
    """Fill the terrain prior from a file; returns the metadata in its header.

    Raises: InputError: the file is missing or too large; see also `fill_weights`.
    """
    path = Path(path)
    if not path.is_file():
        raise InputError(f"{path}: there are no such weights")
    if path.stat().st_size > MOST_BYTES:
        raise InputError(f"{path}: {path.stat().st_size >> 20} MiB are not the weights of this prior")
    return fill_weights(network, path, _own_name, "make or copy the weights again")


def fill_weights(network: nn.Module, path: Path, rename: Callable[[str], str], remedy: str) -> dict[str, str]:
    """Load a file's weights into a network, in its own precision; returns the metadata in the file's header.

    rename: from a weight's name in the file to its name in the network. remedy: ends the messages.
    Raises: InputError: the file is not safetensors, or a tensor is missing, superfluous, of another shape or type, or
    not finite, by name.
    """
    expected = network.state_dict()
    try:
        with safe_open(str(path), "pt") as file:
            names: dict[str, str] = {}
            for name in sorted(file.keys()):
                if name.endswith("position_ids"):  # a constant that older transformers kept among the weights
                    continue
                if rename(name) not in expected or rename(name) in names:
                    raise InputError(f"{path}: {name[:80]!r} is not of this network; {remedy}")
                names[rename(name)] = name
            if missing := sorted(set(expected) - set(names)):
                raise InputError(f"{path}: {missing[0]} is missing; these are the weights of another network; {remedy}")
            for name, value in expected.items():
                header, stored = file.get_slice(names[name]), names[name]
                if (shape := tuple(header.get_shape())) != tuple(value.shape):
                    raise InputError(f"{path}: {stored} has the shape {shape}, not {tuple(value.shape)}; {remedy}")
                if (dtype := header.get_dtype()) not in FLOAT_TYPES:
                    raise InputError(f"{path}: {stored} has the type {dtype}, not floating-point numbers; {remedy}")
            values = {name: file.get_tensor(names[name]).to(value.dtype) for name, value in expected.items()}
            facts = dict(file.metadata() or {})
    except (SafetensorError, *UNREADABLE) as error:
        raise InputError(f"{path}: not readable as safetensors ({summarize_error(error)}); {remedy}") from error
    if bad := [names[name] for name, value in values.items() if not torch.isfinite(value).all()]:
        raise InputError(f"{path}: {bad[0]} holds numbers that are not finite; {remedy}")
    network.load_state_dict(values, assign=True)
    return facts


def _own_name(name: str) -> str:
    part, dot, rest = name.partition(".")
    return STORED_PARTS.get(part, part) + dot + rest
