"""Weights of the terrain prior in a safetensors file: checked before they are loaded, never a pickle."""

from pathlib import Path

import torch
from safetensors import SafetensorError, safe_open
from safetensors.torch import save_file
from torch import nn

from dav_gswt.errors import InputError, summarize_error
from dav_gswt.files import UNREADABLE, atomic_file

TERRAIN_WEIGHTS = Path(__file__).with_name("terrain.safetensors")  # they come with the library
MOST_BYTES = 256 * 2**20
STORED_PREFIXES = {"autoencoder.": "coder.", "condition_encoder.": "told."}  # names in files, ours -> the file's


def save_weights(
    network: nn.Module, path: Path | str, facts: dict[str, str], dtype: torch.dtype = torch.float16
) -> None:
    """Write a network's weights, by default in half precision. facts: metadata for the header."""
    values = {_stored_name(name): v.detach().to("cpu", dtype).contiguous() for name, v in network.state_dict().items()}
    with atomic_file(path) as part:
        save_file(values, str(part), metadata=facts)


def load_weights(network: nn.Module, path: Path | str) -> dict[str, str]:
    """Fill a network from a file; returns the metadata in its header.

    Raises: InputError: the file is missing, too large or not safetensors, or a tensor is missing, superfluous, of
    another shape or not finite, by name.
    """
    path = Path(path)
    if not path.is_file():
        raise InputError(f"{path}: there are no such weights")
    if path.stat().st_size > MOST_BYTES:
        raise InputError(f"{path}: {path.stat().st_size >> 20} MiB are not the weights of this prior")
    expected = {_stored_name(name): value for name, value in network.state_dict().items()}
    try:
        with safe_open(str(path), "pt") as file:
            _check_names(path, set(expected), set(file.keys()))
            for name, value in expected.items():
                shape = tuple(file.get_slice(name).get_shape())
                if shape != tuple(value.shape):
                    raise InputError(f"{path}: {name} has the shape {shape}, not {tuple(value.shape)}")
            values = {name: file.get_tensor(name).to(value.dtype) for name, value in expected.items()}
            facts = dict(file.metadata() or {})
    except (SafetensorError, *UNREADABLE) as error:
        why = summarize_error(error)
        raise InputError(f"{path}: not readable as safetensors ({why}); make or copy the weights again") from error
    if bad := [name for name, value in values.items() if not torch.isfinite(value.float()).all()]:
        raise InputError(f"{path}: {bad[0]} holds numbers that are not finite")
    network.load_state_dict({name: values[_stored_name(name)] for name in network.state_dict()})
    return facts


def _stored_name(name: str) -> str:
    for own, stored in STORED_PREFIXES.items():
        if name.startswith(own):
            return stored + name.removeprefix(own)
    return name


def _check_names(path: Path, expected: set[str], found: set[str]) -> None:
    if missing := sorted(expected - found):
        raise InputError(f"{path}: {missing[0]} is missing; these are the weights of another network")
    if extra := sorted(found - expected):
        raise InputError(f"{path}: {extra[0][:80]!r} is not of this network")
