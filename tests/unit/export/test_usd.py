"""USD: Gaussians as the schema of UsdVol has them, a column at a time; units, up axis and extent of the stage."""

import sys
from types import SimpleNamespace

import numpy as np
import pytest
from fixtures.splat_files import read_usd

from dav_gswt.errors import InputError
from dav_gswt.export import usd
from dav_gswt.export.axes import Y_DOWN, Z_UP, turn_field
from dav_gswt.export.formats import EXPORTERS
from dav_gswt.files import digest_files

FACTS = {"unit": "metre", "origin": [1.5, -2.0, 0.0], "tile_side": 2.0, "cells": {"west": -2, "columns": 4}}
AROUND = FACTS | {"cells": FACTS["cells"] | {"centre": [0, 0.5], "radius": 2.0}}


@pytest.fixture
def pxr():
    return pytest.importorskip("pxr", reason="needs the extra `usd`")


@pytest.mark.parametrize("up, rotation", list(usd.UPWARD.items()))
def test_every_gaussian_is_there_with_the_axis_up_that_the_stage_states(pxr, field, placed, tmp_path, up, rotation):
    from pxr import Usd, UsdGeom

    usd.write_usd(placed, tmp_path / "a.usdc", FACTS, 2.5, rotation)
    read, wanted = read_usd(tmp_path / "a.usdc"), turn_field(field, rotation)
    np.testing.assert_array_equal(read.means, wanted.means)
    np.testing.assert_array_equal(read.sh, wanted.sh)
    np.testing.assert_allclose(read.log_scales, wanted.log_scales, atol=1e-5)
    np.testing.assert_allclose(read.opacity_logits, wanted.opacity_logits, atol=1e-4)
    np.testing.assert_allclose(read.quats, wanted.quats, atol=1e-6)
    stage = Usd.Stage.Open(str(tmp_path / "a.usdc"))
    assert UsdGeom.GetStageUpAxis(stage) == up and UsdGeom.GetStageMetersPerUnit(stage) == 2.5
    assert stage.GetDefaultPrim().GetPath() == usd.ROOT


def test_a_stage_is_valid_and_knows_where_it_lies_and_how_far_it_reaches(pxr, placed, tmp_path):
    from pxr import Usd, UsdGeom, UsdValidation

    usd.write_usd(placed, tmp_path / "a.usdc", AROUND, 1.0)
    stage = Usd.Stage.Open(str(tmp_path / "a.usdc"))
    kept = stage.GetRootLayer().customLayerData
    assert list(kept["origin"]) == FACTS["origin"] and kept["unit"] == "metre"
    assert list(kept["cells"].pop("centre")) == [0, 0.5] and kept["cells"] == FACTS["cells"] | {"radius": 2.0}
    bounds = UsdGeom.BBoxCache(Usd.TimeCode.Default(), [UsdGeom.Tokens.default_])
    low, high = placed.find_box(Z_UP)
    reach = bounds.ComputeWorldBound(stage.GetDefaultPrim()).ComputeAlignedRange()
    assert (np.array(reach.GetMin()) <= low).all() and (np.array(reach.GetMax()) >= high).all()
    np.testing.assert_allclose([reach.GetMin(), reach.GetMax()], [low, high], rtol=1e-6)
    known = Usd.SchemaRegistry().FindConcretePrimDefinition("ParticleField3DGaussianSplat")
    for attribute in stage.GetPrimAtPath(usd.PRIM).GetAuthoredAttributes():
        assert attribute.GetName() in known.GetPropertyNames() and not attribute.IsCustom()
    validators = UsdValidation.ValidationRegistry().GetOrLoadAllValidators()
    errors = UsdValidation.ValidationContext(validators).Validate(stage)
    assert len(validators) > 10 and [error.GetMessage() for error in errors] == []


def test_the_same_gaussians_give_the_same_bytes_of_the_announced_size_and_y_down_is_refused(
    pxr, field, placed, tmp_path
):
    with pytest.raises(ValueError, match="y or z up"):
        usd.write_usd(placed, tmp_path / "a.usdc", FACTS, 1.0, Y_DOWN)
    for name in ("a.usdc", "b.usdc"):
        usd.write_usd(placed, tmp_path / name, FACTS, 1.0)
    assert digest_files(tmp_path / "a.usdc") == digest_files(tmp_path / "b.usdc")
    assert (tmp_path / "a.usdc").stat().st_size <= len(field) * EXPORTERS["usd"].bytes + 65_536
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a.usdc", "b.usdc", "spool"]


@pytest.mark.parametrize("missing", [True, False])
def test_without_the_package_or_with_one_older_than_the_schema_the_extra_is_named(monkeypatch, missing):
    if missing:
        monkeypatch.setitem(sys.modules, "pxr.Usd", None)
    else:
        monkeypatch.setattr(usd.importlib, "import_module", lambda name: SimpleNamespace())
    with pytest.raises(InputError, match=r"exports: USD needs the extra `usd`, pip install 'usd-core>=26\.3'"):
        usd.find_package()
