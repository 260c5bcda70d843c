"""Gaussians as OpenUSD: one prim of the schema ParticleField3DGaussianSplat (UsdVol, OpenUSD 26.03 and newer).

Source: schema.usda of UsdVol. Scales are standard deviations and opacities are in [0, 1]. The schema states only the
order of the harmonics; as in Pixar's own converter they are those of a PLY: the trained colour is 0.5 more than the
sum of the harmonics. Needs the package usd-core.
"""

import importlib
from collections.abc import Callable, Mapping
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array
from scipy.special import expit

import dav_gswt
from dav_gswt.errors import InputError
from dav_gswt.export.axes import Y_UP, Z_UP, turn_points, turn_quats
from dav_gswt.export.spool import Spool
from dav_gswt.files import atomic_file

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
        raise InputError("exports: USD needs the extra `usd`, pip install 'usd-core>=26.3'; other formats do not")
    return pxr


def write_usd(
    spool: Spool,
    path: Path | str,
    facts: Mapping[str, Any],
    metres_per_unit: float,
    rotation: Float[Array, "3 3"] = Z_UP,
) -> None:
    """Write Gaussians to a .usdc, one column after the other, so that memory holds one of them.

    Args:   facts: numbers, texts, lists and tables of these, kept as custom data of the layer. rotation: of UPWARD.
    Raises: InputError: see `find_package`. ValueError: another rotation, or no Gaussian.
    """
    pxr = find_package()
    up = next((name for name, rows in UPWARD.items() if np.array_equal(rows, rotation)), None)
    if up is None:
        raise ValueError("a stage has y or z up")
    box = spool.find_box(rotation)
    with atomic_file(path) as part:
        stage = pxr.Usd.Stage.CreateNew(str(part))
        _describe_stage(pxr, stage, up, metres_per_unit, facts)
        prim = _define_splats(pxr, stage, box)
        for name, (source, kind, pack) in _list_columns(pxr, rotation).items():
            values = np.concatenate([pack(values).astype("<f4") for values in spool.read(source)])
            prim.GetAttribute(name).Set(kind.FromNumpy(values[:, 0] if values.shape[1] == 1 else values))
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
    layer.customLayerData = _to_usd(pxr, facts)


def _to_usd(pxr: SimpleNamespace, value: Any) -> Any:
    """Lists become arrays of doubles, also in dictionaries: USD keeps no list."""
    if isinstance(value, Mapping):
        return {key: _to_usd(pxr, inner) for key, inner in value.items()}
    return pxr.Vt.DoubleArray([float(v) for v in value]) if isinstance(value, list) else value


def _define_splats(pxr: SimpleNamespace, stage: Any, box: tuple[Array, Array]) -> Any:
    """The prim, without its columns."""
    splats = pxr.UsdVol.ParticleField3DGaussianSplat.Define(stage, PRIM)
    ends = [np.nextafter(np.float32(end), np.float32(way)) for end, way in zip(box, (-np.inf, np.inf), strict=True)]
    splats.CreateExtentAttr([pxr.Gf.Vec3f(*map(float, end)) for end in ends])
    splats.CreateRadianceSphericalHarmonicsDegreeAttr(0)
    splats.CreateProjectionModeHintAttr("perspective")
    splats.CreateSortingModeHintAttr("cameraDistance")
    for create in ("Positions", "Orientations", "Scales", "Opacities", "RadianceSphericalHarmonicsCoefficients"):
        getattr(splats, f"Create{create}Attr")()
    return splats.GetPrim()


def _list_columns(
    pxr: SimpleNamespace, rotation: Float[Array, "3 3"]
) -> dict[str, tuple[str, Any, Callable[[Array], Array]]]:
    """For each property its column of a spool, the type of its values, and how they are made.

    In memory a quaternion of USD is x y z w, though it is written and printed w x y z.
    """
    vectors = pxr.Vt.Vec3fArray
    return {
        "positions": ("means", vectors, lambda v: turn_points(v, rotation)),
        "orientations": ("quats", pxr.Vt.QuatfArray, lambda v: turn_quats(v, rotation)[:, [1, 2, 3, 0]]),
        "scales": ("log_scales", vectors, lambda v: np.exp(v.astype(float))),
        "opacities": ("opacity_logits", pxr.Vt.FloatArray, lambda v: expit(v.astype(float))),
        "radiance:sphericalHarmonicsCoefficients": ("dc", vectors, lambda v: v),
    }
