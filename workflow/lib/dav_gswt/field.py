"""`GaussianField`, the arrays of a 3D Gaussian splat, and the standard 3DGS PLY that stores them."""

import re
from collections.abc import Sequence
from dataclasses import dataclass, fields
from pathlib import Path
from typing import TypeVar

import numpy as np
from jaxtyping import Bool, Float, Float32
from numpy import ndarray as Array
from plyfile import PlyData, PlyElement, PlyParseError

from dav_gswt.errors import InputError, summarize_error
from dav_gswt.files import UNREADABLE, atomic_file

SH0 = 0.28209479177387814  # the constant real spherical harmonic, 1 / (2 sqrt(pi))
HEADER_BYTES = 1 << 16  # a header is no longer than this
ROUNDING = 1e-5  # that an uncertainty may lie outside 0 to 1


R = TypeVar("R", bound="Rows")


@dataclass(frozen=True)
class Rows:
    """A base of dataclasses whose fields are arrays with a row for each thing."""

    def __len__(self) -> int:
        return len(getattr(self, fields(self)[0].name))

    def __getitem__(self: R, index: slice | Array) -> R:
        """The rows that a mask, a slice or an index array selects."""
        return type(self)(*(getattr(self, f.name)[index] for f in fields(self)))

    @classmethod
    def concatenate(cls: type[R], parts: Sequence[R]) -> R:
        """The rows of all parts, in their order."""
        return cls(*(np.concatenate([getattr(part, f.name) for part in parts]) for f in fields(cls)))


@dataclass(frozen=True)
class GaussianField(Rows):
    """n Gaussians in the world frame: z up, in the scene's unit of length.

    log_scales: natural logarithms of the standard deviations along the axes of `quats`.
    quats: rotations as quaternions w x y z, of any length but 0.
    opacity_logits: peak opacity = expit(logit).
    sh: colour coefficients, degree 0 first: colour = 0.5 + SH0 sh[:, 0] + ...
    uncertainty: from 0 (certain) to 1 (unobserved).
    ground: whether the Gaussian is a disc of the ground layer.
    imagined: whether a prior made the Gaussian, where no photo sees it; by default none.
    """

    means: Float32[Array, "n 3"]
    log_scales: Float32[Array, "n 3"]
    quats: Float32[Array, "n 4"]
    opacity_logits: Float32[Array, "n"]
    sh: Float32[Array, "n k 3"]
    uncertainty: Float32[Array, "n"]
    ground: Bool[Array, "n"]
    imagined: Bool[Array, "n"] = None  # pyright: ignore[reportAssignmentType]  # __post_init__ fills it in

    def __post_init__(self):
        if self.imagined is None:
            object.__setattr__(self, "imagined", np.zeros(len(self.means), bool))

    @property
    def sh_degree(self) -> int:
        """Degree of the spherical harmonics."""
        return int(np.sqrt(self.sh.shape[1])) - 1

    @property
    def base_colours(self) -> Float32[Array, "n 3"]:
        """Colour without its view-dependent part."""
        return 0.5 + np.float32(SH0) * self.sh[:, 0]


def concatenate_fields(parts: list[GaussianField]) -> GaussianField:
    """One field of all parts, in their order."""
    return GaussianField.concatenate(parts)


def mean_scale(parts: list[GaussianField]) -> float:
    """Mean standard deviation over all axes of all Gaussians: how the GSWT renderer measures a level."""
    return float(np.mean(np.concatenate([np.exp(p.log_scales.astype(float)).mean(1) for p in parts])))


def rgb_to_sh(colours: Float[Array, "n 3"]) -> Float32[Array, "n 1 3"]:
    """Degree-0 coefficients of colours that do not depend on the view."""
    return ((colours - 0.5) / SH0).astype(np.float32)[:, None]


def _columns(k: int) -> dict[str, list[str]]:
    """Names of the 3DGS PLY's properties by field; f_rest is channel-major, as the original 3DGS writes it."""
    return {
        "means": ["x", "y", "z"],
        "dc": [f"f_dc_{i}" for i in range(3)],
        "rest": [f"f_rest_{i}" for i in range(3 * (k - 1))],
        "opacity_logits": ["opacity"],
        "log_scales": [f"scale_{i}" for i in range(3)],
        "quats": [f"rot_{i}" for i in range(4)],
    }


def write_field(field: GaussianField, path: Path | str, plain: bool = False) -> None:
    """Write a standard 3DGS PLY, with `uncertainty` and `ground` as two more properties, which most viewers ignore.

    `imagined` is a third one, written only if it is set anywhere. plain: none of them, and so nothing but float32, as
    readers that know no other type need it.
    """
    n, k = field.sh.shape[:2]
    names = _columns(k)
    written = {  # in the order of the original 3DGS
        (*names["means"],): field.means,
        ("nx", "ny", "nz"): np.zeros((n, 3), np.float32),
        (*names["dc"],): field.sh[:, 0],
        (*names["rest"],): field.sh[:, 1:].transpose(0, 2, 1).reshape(n, 3 * (k - 1)),
        (*names["opacity_logits"],): field.opacity_logits[:, None],
        (*names["log_scales"],): field.log_scales,
        (*names["quats"],): field.quats,
    }
    columns = {name: values[:, j] for keys, values in written.items() for j, name in enumerate(keys)}
    kinds = [(name, "<f4") for name in columns]
    if not plain:
        kinds += [("uncertainty", "<f4"), ("ground", "u1")] + [("imagined", "u1")] * bool(field.imagined.any())
    rows = np.empty(n, dtype=kinds)
    for name, _ in kinds:
        rows[name] = columns[name] if name in columns else getattr(field, name)
    with atomic_file(path) as part:
        PlyData([PlyElement.describe(rows, "vertex")], byte_order="<").write(str(part))


def read_field(path: Path | str) -> GaussianField:
    """Read a 3DGS PLY. In files of other programs `uncertainty`, `ground` and `imagined` are 0.

    An uncertainty outside 0 to 1 by no more than ROUNDING is clipped.
    Raises: InputError: the file is not a PLY, its header is longer than HEADER_BYTES, a property is missing or a list,
    a value is not finite, an uncertainty is outside 0 to 1, or `imagined` is neither 0 nor 1; with the index of the
    first such Gaussian.
    """
    path = Path(path)
    rows = _vertices(path)
    rest = sum(name.startswith("f_rest_") for name in (rows.dtype.names or ()))
    k = 1 + rest // 3
    if rest % 3 or k not in (1, 4, 9, 16):
        raise InputError(f"{path}: {rest} f_rest properties; 0, 9, 24 or 45 make whole spherical harmonics")
    columns = {key: _stack(rows, names, path) for key, names in _columns(k).items()}
    quats = columns["quats"]
    if len(zero := np.flatnonzero(~(np.abs(quats).max(1) > 0))):
        raise InputError(f"{path}: Gaussian {zero[0]} has a zero quaternion; remove it and try again")
    n = len(rows)
    shs = np.concatenate([columns["dc"][:, None], columns["rest"].reshape(n, 3, k - 1).transpose(0, 2, 1)], 1)
    ours = ("uncertainty", "ground", "imagined")
    extra = {name: _column(rows, name, path) if name in (rows.dtype.names or ()) else np.zeros(n) for name in ours}
    if len(bad := np.flatnonzero((extra["imagined"] != 0) & (extra["imagined"] != 1))):
        raise InputError(f"{path}: imagined of Gaussian {bad[0]} is neither 0 nor 1; write the field again")
    uncertainty = _finite(np.asarray(extra["uncertainty"], np.float32), "uncertainty", path)
    if len(bad := np.flatnonzero((uncertainty < -ROUNDING) | (uncertainty > 1 + ROUNDING))):
        value = f"uncertainty of Gaussian {bad[0]} is {uncertainty[bad[0]]:g}"
        raise InputError(f"{path}: {value}; write numbers from 0 to 1, or none at all")
    return GaussianField(
        columns["means"],
        columns["log_scales"],
        quats,
        columns["opacity_logits"][:, 0],
        np.ascontiguousarray(shs, np.float32),
        np.clip(uncertainty, 0, 1),
        np.asarray(extra["ground"]).astype(bool),
        np.asarray(extra["imagined"]).astype(bool),
    )


def _vertices(path: Path) -> Array:
    """The vertex table. plyfile allocates what the header says, so its counts are checked against the file first."""
    try:
        _check_counts(path)
        vertices = PlyData.read(str(path))
        if "vertex" not in vertices or not vertices["vertex"].properties:
            raise InputError(f"{path}: no vertices; a 3DGS .ply has an element 'vertex'")
        return vertices["vertex"].data
    except FileNotFoundError:
        raise InputError(f"{path}: there is no such file") from None
    except (PlyParseError, *UNREADABLE) as error:
        raise InputError(f"{path}: not a readable PLY ({summarize_error(error)}); export or copy it again") from error


def _check_counts(path: Path) -> None:
    """Raises: InputError: no PLY, a header without end, or one that announces more values than the file has bytes."""
    with path.open("rb") as file:
        begin = file.read(HEADER_BYTES)
    if not begin.startswith(b"ply"):
        raise InputError(f"{path}: not a readable PLY (it does not begin with 'ply'); export or copy it again")
    end = re.search(rb"[\r\n]end_header\b", begin)  # at the start of a line: a comment may name it too
    if not end:
        problem = f"not a readable PLY (no end_header in the first {HEADER_BYTES} bytes)"
        raise InputError(f"{path}: {problem}; export it again, without long comments")
    header, room = begin[: end.start()], path.stat().st_size - end.end()
    announced = 0
    for count, properties in re.findall(rb"element\s+\S+\s+(\d+)((?:(?!element\s)[\s\S])*)", header):
        announced += int(count) * max(1, properties.count(b"property"))
    if announced > room:
        raise InputError(f"{path}: the header announces more than the file holds ({room} bytes); is it cut short?")


def _stack(rows: Array, names: list[str], path: Path) -> Float32[Array, "n m"]:
    missing = [name for name in names if name not in (rows.dtype.names or ())]
    if missing:
        raise InputError(f"{path}: property {missing[0]} is missing; a 3D Gaussian splatting .ply is needed")
    out = np.empty((len(rows), len(names)), np.float32)
    for j, name in enumerate(names):
        with np.errstate(over="ignore"):
            out[:, j] = _column(rows, name, path)
        _finite(out[:, j], name, path)
    return out


def _column(rows: Array, name: str, path: Path) -> Array:
    """A property's values, one a Gaussian."""
    if rows.dtype[name].hasobject:
        raise InputError(f"{path}: property {name} is a list; export it again with one number a Gaussian")
    return rows[name]


def _finite(values: Array, name: str, path: Path) -> Array:
    if len(bad := np.flatnonzero(~np.isfinite(values))):
        where = f"{name} of Gaussian {bad[0]} is not finite ({len(bad)} such)"
        raise InputError(f"{path}: {where}; remove them and try again")
    return values
