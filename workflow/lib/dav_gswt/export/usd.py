"""Gaussians as OpenUSD: one prim of the schema ParticleField3DGaussianSplat (UsdVol, OpenUSD 26.03 and newer).

Source: schema.usda of UsdVol. Scales are standard deviations, not their logarithms, and opacities lie in [0, 1]. Of the
harmonics the schema tells the order alone; as in Pixar's own converter they are those of a PLY: colours as they were
trained are 0.5 more than what the harmonics sum to. A .usdc and not a .usdz, which packs files that belong together:
here there is one, and a .usdc can be read where it lies. Needs the package usd-core.
"""

import importlib
from collections.abc import Callable, Mapping
from pathlib import Path
from tempfile import TemporaryDirectory
from types import SimpleNamespace
from typing import Any

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array
from scipy.special import expit

import dav_gswt
from dav_gswt.errors import InputError
from dav_gswt.export.axes import Y_UP, Z_UP, turn_points, turn_quats
from dav_gswt.export.bounds import find_box
from dav_gswt.export.spool import Spool
from dav_gswt.files import atomic_file

EXTRA = "usd-core>=26.3"
BYTES = 56  # of a Gaussian
HEADER_BYTES = 65_536  # more than a file has beside its Gaussians
ROOT, PRIM = "/terrain", "/terrain/splats"
UPWARD = {"Y": Y_UP, "Z": Z_UP}  # a stage has no other axis up
_MODULES = ("Gf", "Sdf", "Usd", "UsdGeom", "UsdVol", "Vt")


def find_package() -> SimpleNamespace:
    """The modules of usd-core that are used. Raises: InputError: it is not installed, or older than the schema."""
    try:
        pxr = SimpleNamespace(**{name: importlib.import_module(f"pxr.{name}") for name in _MODULES})
    except ImportError:
        pxr = None
    if pxr is None or not hasattr(pxr.UsdVol, "ParticleField3DGaussianSplat"):
        raise InputError(f"exports/terrain: USD needs the extra `usd`, pip install '{EXTRA}'; other formats do not")
    return pxr


def write_usd(
    spool: Spool,
    path: Path | str,
    facts: Mapping[str, Any],
    metres_per_unit: float,
    rotation: Float[Array, "3 3"] = Z_UP,
) -> None:
    """Write Gaussians to a .usdc, a column at a time: memory holds 16 bytes a Gaussian, not all 56.

    Args:   facts: numbers, texts, lists and tables of these, kept as custom data of the layer. rotation: of UPWARD.
    Raises: InputError: see `find_package`. ValueError: another rotation, or no Gaussian.
    """
    pxr = find_package()
    up = next((name for name, rows in UPWARD.items() if np.array_equal(rows, rotation)), None)
    if up is None:
        raise ValueError("a stage has y or z up")
    box = find_box(spool, rotation)
    with atomic_file(path) as part, TemporaryDirectory(dir=part.parent) as place:
        stage = pxr.Usd.Stage.CreateNew(str(part))
        _describe_stage(pxr, stage, up, metres_per_unit, facts)
        prim = _define_splats(pxr, stage, box)
        for name, (source, kind, width, pack) in _list_columns(pxr, rotation).items():
            values = _pack_column(spool, source, width, pack, Path(place, source))
            prim.GetAttribute(name).Set(kind.FromNumpy(values[:, 0] if width == 1 else values))
            stage.GetRootLayer().Save()  # what is saved leaves memory; the next column goes behind it
        del prim, stage


def _describe_stage(
    pxr: SimpleNamespace, stage: Any, up: str, metres_per_unit: float, facts: Mapping[str, Any]
) -> None:
    pxr.UsdGeom.SetStageUpAxis(stage, up)
    pxr.UsdGeom.SetStageMetersPerUnit(stage, metres_per_unit)
    root = pxr.UsdGeom.Xform.Define(stage, ROOT)
    pxr.Usd.ModelAPI(root).SetKind("component")
    stage.SetDefaultPrim(root.GetPrim())
    layer = stage.GetRootLayer()
    layer.documentation = f"DAV-GSWT {dav_gswt.__version__}"
    layer.customLayerData = {key: _to_usd(pxr, value) for key, value in facts.items()}


def _to_usd(pxr: SimpleNamespace, value: Any) -> Any:
    """Lists as arrays of doubles, in dictionaries, too; USD keeps no list."""
    if isinstance(value, Mapping):
        return {key: _to_usd(pxr, inner) for key, inner in value.items()}
    return pxr.Vt.DoubleArray([float(v) for v in value]) if isinstance(value, list) else value


def _define_splats(pxr: SimpleNamespace, stage: Any, box: tuple[Array, Array]) -> Any:
    """The prim, but for its columns."""
    splats = pxr.UsdVol.ParticleField3DGaussianSplat.Define(stage, PRIM)
    low, high = (
        np.nextafter(np.float32(end), np.float32(way)) for end, way in zip(box, (-np.inf, np.inf), strict=True)
    )
    splats.CreateExtentAttr([pxr.Gf.Vec3f(*map(float, end)) for end in (low, high)])
    splats.CreateRadianceSphericalHarmonicsDegreeAttr(0)
    splats.CreateProjectionModeHintAttr("perspective")
    splats.CreateSortingModeHintAttr("cameraDistance")
    for create in ("Positions", "Orientations", "Scales", "Opacities", "RadianceSphericalHarmonicsCoefficients"):
        getattr(splats, f"Create{create}Attr")()
    return splats.GetPrim()


def _list_columns(
    pxr: SimpleNamespace, rotation: Float[Array, "3 3"]
) -> dict[str, tuple[str, Any, int, Callable[[Array], Array]]]:
    """Of each property its column of a spool, the type of its values, their width, and how they are made.

    In memory a quaternion of USD is x y z w, though it is written and printed w x y z.
    """
    vectors = pxr.Vt.Vec3fArray
    return {
        "positions": ("means", vectors, 3, lambda v: turn_points(v, rotation)),
        "orientations": ("quats", pxr.Vt.QuatfArray, 4, lambda v: turn_quats(v, rotation)[:, [1, 2, 3, 0]]),
        "scales": ("log_scales", vectors, 3, lambda v: np.exp(v.astype(float))),
        "opacities": ("opacity_logits", pxr.Vt.FloatArray, 1, lambda v: expit(v.astype(float))),
        "radiance:sphericalHarmonicsCoefficients": ("dc", vectors, 3, lambda v: v),
    }


def _pack_column(spool: Spool, source: str, width: int, pack: Callable[[Array], Array], place: Path) -> Array:
    """A property's values, float32, in a file that takes the place of memory."""
    with place.open("wb") as file:
        for part in spool.read(source):
            file.write(np.ascontiguousarray(pack(part), "<f4").tobytes())
    return np.memmap(place, "<f4", "r", shape=(len(spool), width))
