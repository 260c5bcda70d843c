"""Weights of a prior in a safetensors file: checked before they are loaded, never a pickle."""

from pathlib import Path

import torch
from safetensors import SafetensorError, safe_open
from safetensors.torch import save_file
from torch import nn

from dav_gswt.errors import InputError
from dav_gswt.files import whole

TERRAIN = Path(__file__).with_name("terrain.safetensors")  # of the project's own prior
MOST_BYTES = 256 * 2**20


def save(network: nn.Module, path: Path | str, facts: dict[str, str], kind: torch.dtype = torch.float16) -> None:
    """Write a network's weights, in half precision if not told otherwise, with facts about them in the header."""
    values = {name: v.detach().to("cpu", kind).contiguous() for name, v in network.state_dict().items()}
    with whole(path) as part:
        save_file(values, str(part), metadata=facts)


def load(network: nn.Module, path: Path | str) -> dict[str, str]:
    """Fill a network from a file; returns the facts in its header.

    Raises: InputError: missing, too large, not safetensors (a pickle is never read), a tensor that is missing, of
    another shape or not finite, or one too many, by name.
    """
    path = Path(path)
    if not path.is_file():
        raise InputError(f"{path}: there are no such weights")
    if path.stat().st_size > MOST_BYTES:
        raise InputError(f"{path}: {path.stat().st_size >> 20} MiB are not the weights of this prior")
    wanted = network.state_dict()
    try:
        with safe_open(str(path), "pt") as file:
            _same_names(path, set(wanted), set(file.keys()))
            for name, value in wanted.items():
                shape = tuple(file.get_slice(name).get_shape())
                if shape != tuple(value.shape):
                    raise InputError(f"{path}: {name} has the shape {shape}, not {tuple(value.shape)}")
            values = {name: file.get_tensor(name).to(wanted[name].dtype) for name in wanted}
            facts = dict(file.metadata() or {})
    except (SafetensorError, OSError) as error:
        raise InputError(f"{path}: not readable as safetensors ({error}); make or copy the weights again") from error
    if bad := [name for name, value in values.items() if not torch.isfinite(value.float()).all()]:
        raise InputError(f"{path}: {bad[0]} holds numbers that are not finite")
    network.load_state_dict(values)
    return facts


def _same_names(path: Path, wanted: set[str], found: set[str]) -> None:
    if missing := sorted(wanted - found):
        raise InputError(f"{path}: {missing[0]} is missing; these are the weights of another network")
    if extra := sorted(found - wanted):
        raise InputError(f"{path}: {extra[0]} is not of this network")
