"""`GaussianField`, the arrays of a 3D Gaussian splat, and the standard 3DGS PLY that stores them."""

import re
from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from jaxtyping import Bool, Float, Float32, Float64
from numpy import ndarray as Array
from plyfile import PlyData, PlyElement, PlyParseError

from dav_gswt.arrays import to_single
from dav_gswt.errors import InputError, summarize_error
from dav_gswt.files import UNREADABLE, atomic_file
from dav_gswt.packed_ply import COLUMNS as PACKED
from dav_gswt.packed_ply import unpack_vertices

SH0 = 0.28209479177387814  # the constant real spherical harmonic, 1 / (2 sqrt(pi))
HEADER_BYTES = 1 << 16  # a header is no longer than this
ROUNDING = 1e-5  # that an uncertainty may lie outside 0 to 1
BLOCK = 16 << 20  # bytes of a file that are read at a time
THIN = 0.05  # the third deviation of a disc, as a share of the largest
MOST = 16.0  # the logit in place of an infinite one: an opacity of 1 - 1e-7
FAR = 10.0  # extents of a field that doubles lie from 0, from which they are counted from an origin


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

    def with_harmonics(self, count: int) -> "GaussianField":
        """With so many colour coefficients: higher ones are dropped, new ones are zero."""
        kept = self.sh[:, :count]
        return replace(self, sh=np.pad(kept, ((0, 0), (0, count - kept.shape[1]), (0, 0))))


@dataclass(frozen=True)
class Splats:
    """A finished field as its file has it.

    origin: where the positions count from, in the file's coordinates. sh_degree: of the harmonics in the file, though
    fewer may have been read.
    """

    field: GaussianField
    origin: Float64[Array, "3"]
    sh_degree: int


def concatenate_fields(parts: list[GaussianField]) -> GaussianField:
    """One field of all parts, in their order."""
    return GaussianField.concatenate(parts)


def mean_scale(parts: list[GaussianField]) -> float:
    """Mean standard deviation over all axes of all Gaussians: how the GSWT renderer measures a level."""
    return float(np.mean(np.concatenate([np.exp(p.log_scales.astype(float)).mean(1) for p in parts])))


def rgb_to_sh(colours: Float[Any, "n 3"]) -> Float32[Any, "n 1 3"]:
    """Degree-0 coefficients of colours that do not depend on the view."""
    return to_single((colours - 0.5) / SH0)[:, None]


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
    """Read a 3DGS PLY, with all harmonics; see `read_ply`. Positions far from 0 are counted from its origin."""
    return read_ply(path).field


def read_ply(path: Path | str, harmonics: bool = True) -> Splats:
    """Read a 3DGS PLY of any common trainer, in blocks of BLOCK bytes. harmonics: those above degree 0 are read too.

    Of 2DGS, whose discs have two deviations, the third is THIN of the largest; the same where a file has zero. The
    `filter_3D` of Mip-Splatting is fused: variances grow by its square, and opacities shrink so that the Gaussians keep
    their mass. A compressed PLY (PlayCanvas) is unpacked, without harmonics. An infinite opacity is clamped to a logit
    of MOST. In files of other programs `uncertainty`, `ground` and `imagined` are 0; an uncertainty outside 0 to 1 by
    no more than ROUNDING is clipped.
    Raises: InputError: the file is not a PLY, its header is longer than HEADER_BYTES, a property is missing or a list,
    a value is not finite, an uncertainty is outside 0 to 1, or `imagined` is neither 0 nor 1; with the index of the
    first such Gaussian.
    """
    path = Path(path)
    tables = _read_tables(path)
    rows = tables["vertex"].data
    present = rows.dtype.names or ()
    if PACKED[0] in present:
        try:
            columns = unpack_vertices(tables["chunk"].data if "chunk" in tables else None, rows)
        except ValueError as error:
            raise InputError(f"{path}: {error}; export it again") from error
        rest = tables["sh"].properties if "sh" in tables else ()
        field = build_field(path, sh=rgb_to_sh(columns.pop("colours")), **columns)
        return Splats(field, np.zeros(3), int(np.sqrt(len(rest) / 3 + 1)) - 1)
    rest = sum(name.startswith("f_rest_") for name in present)
    k = 1 + rest // 3 if harmonics else 1
    if harmonics and (rest % 3 or k not in (1, 4, 9, 16)):
        raise InputError(f"{path}: {rest} f_rest properties; 0, 9, 24 or 45 make whole spherical harmonics")
    names = _columns(k) | {
        name: [name] for name in ("filter_3D", "uncertainty", "ground", "imagined") if name in present
    }
    if "scale_2" not in present:
        names["log_scales"] = names["log_scales"][:2]
    columns = _gather(rows, names, path)
    means, origin = _take_origin(columns.pop("means"))
    if "filter_3D" in columns:
        _fuse_filter(columns)
    rest_columns, dc = columns.pop("rest"), columns.pop("dc")
    sh = np.concatenate([dc[:, None], rest_columns.reshape(len(rows), 3, k - 1).transpose(0, 2, 1)], 1)
    columns = {name: values[:, 0] if values.shape[1] == 1 else values for name, values in columns.items()}
    return Splats(build_field(path, means=means, sh=sh, **columns), origin, int(np.sqrt(1 + rest // 3)) - 1)


def build_field(
    path: Path,
    *,
    means: Float[Array, "n 3"],
    sh: Float[Array, "n k 3"],
    log_scales: Float[Array, "n m"],
    quats: Float[Array, "n 4"],
    opacity_logits: Float[Array, "n"],
    uncertainty: Float[Array, "n"] | None = None,
    ground: Float[Array, "n"] | None = None,
    imagined: Float[Array, "n"] | None = None,
) -> GaussianField:
    """A field of a file's columns, checked and mended as `read_ply` says. Raises: InputError: as there."""
    none = np.zeros(len(means), np.float32)
    columns = {"means": means, "log_scales": _thicken(log_scales), "quats": quats}
    columns["opacity_logits"] = np.where(np.isinf(opacity_logits), np.copysign(MOST, opacity_logits), opacity_logits)
    columns["dc"], columns["rest"] = sh[:, 0], sh[:, 1:].transpose(0, 2, 1)
    for key, names in _columns(sh.shape[1]).items():
        for j, name in enumerate(names):
            _require_finite(columns[key][:, *np.unravel_index(j, columns[key].shape[1:])], name, path)
    if len(zero := np.flatnonzero(~quats.any(1))):
        raise InputError(f"{path}: Gaussian {zero[0]} has a zero quaternion; remove it and try again")
    imagined, uncertainty = (none if values is None else values for values in (imagined, uncertainty))
    if len(bad := np.flatnonzero((imagined != 0) & (imagined != 1))):
        raise InputError(f"{path}: imagined of Gaussian {bad[0]} is neither 0 nor 1; write the field again")
    _require_finite(uncertainty, "uncertainty", path)
    if len(bad := np.flatnonzero((uncertainty < -ROUNDING) | (uncertainty > 1 + ROUNDING))):
        value = f"uncertainty of Gaussian {bad[0]} is {uncertainty[bad[0]]:g}"
        raise InputError(f"{path}: {value}; write numbers from 0 to 1, or none at all")
    return GaussianField(
        np.asarray(means, np.float32),
        np.asarray(columns["log_scales"], np.float32),
        np.asarray(quats, np.float32),
        np.asarray(columns["opacity_logits"], np.float32),
        np.ascontiguousarray(sh, np.float32),
        np.clip(uncertainty, 0, 1),
        (none if ground is None else ground).astype(bool),
        imagined.astype(bool),
    )


def _thicken(log_scales: Float[Array, "n m"]) -> Float[Array, "n 3"]:
    """Deviations of three axes; one that is missing, or zero, is THIN of the largest."""
    if log_scales.shape[1] == 2:
        log_scales = np.column_stack([log_scales, np.full(len(log_scales), -np.inf, log_scales.dtype)])
    if (zero := np.isneginf(log_scales)).any():
        log_scales = np.where(zero, log_scales.max(1, keepdims=True) + log_scales.dtype.type(np.log(THIN)), log_scales)
    return log_scales


def _fuse_filter(columns: dict[str, Array]) -> None:
    """Fuse Mip-Splatting's 3D smoothing filter into deviations and opacities, in place: its `create_fused_ply`."""
    scales, size = _thicken(columns["log_scales"]).astype(float), columns.pop("filter_3D").astype(float)
    with np.errstate(all="ignore"):  # the checks below refuse values that are not finite
        wider = 0.5 * np.logaddexp(2 * scales, 2 * np.log(np.abs(size)))
        log_opacity = -np.logaddexp(0, -columns["opacity_logits"].astype(float)) + (scales - wider).sum(
            1, keepdims=True
        )
        columns["opacity_logits"] = (log_opacity - np.log(-np.expm1(log_opacity))).astype(np.float32)
    columns["log_scales"] = wider.astype(np.float32)


def _take_origin(means: Float[Array, "n 3"]) -> tuple[Float32[Array, "n 3"], Float[Array, "3"]]:
    """Positions for float32, and the origin, in whole units, from which they count: 0 unless doubles lie far from 0."""
    origin = np.zeros(3)
    if means.dtype == np.float64 and len(means) and np.isfinite(means).all():
        low, middle, high = np.percentile(means, [10, 50, 90], axis=0)
        if (np.abs(middle) > FAR * (high - low).max()).any():
            origin = np.round(middle)
    with np.errstate(over="ignore"):
        return np.asarray(means - origin if origin.any() else means, np.float32), origin


def _gather(rows: Array, names: dict[str, list[str]], path: Path) -> dict[str, Float[Array, "n m"]]:
    """Columns of a table by key: positions in float64 if the file has doubles, all else in float32."""
    for name in (name for listed in names.values() for name in listed):
        if name not in (rows.dtype.names or ()):
            raise InputError(f"{path}: property {name} is missing; a 3D Gaussian splatting .ply is needed")
        if rows.dtype[name].hasobject:
            raise InputError(f"{path}: property {name} is a list; export it again with one number a Gaussian")
    double = any(rows.dtype[name].itemsize > 4 for name in names["means"])
    out = {
        key: np.empty((len(rows), len(listed)), np.float64 if key == "means" and double else np.float32)
        for key, listed in names.items()
    }
    step = max(1, BLOCK // max(1, rows.dtype.itemsize))
    for part in (slice(start, start + step) for start in range(0, len(rows), step)):
        block = rows[part]
        for key, listed in names.items():
            for j, name in enumerate(listed):
                with np.errstate(over="ignore"):
                    out[key][part, j] = block[name]
    return out


def _read_tables(path: Path) -> PlyData:
    """A PLY with vertices. plyfile allocates what the header says, so its counts are checked against the file first."""
    try:
        _check_counts(path)
        tables = PlyData.read(str(path))
        if "vertex" not in tables or not tables["vertex"].properties:
            raise InputError(f"{path}: no vertices; a 3DGS .ply has an element 'vertex'")
        return tables
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


def _require_finite(values: Array, name: str, path: Path) -> None:
    if len(bad := np.flatnonzero(~np.isfinite(values))):
        where = f"{name} of Gaussian {bad[0]} is not finite ({len(bad)} such)"
        raise InputError(f"{path}: {where}; remove them and try again")
