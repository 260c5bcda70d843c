"""USD: Gaussians as the schema of UsdVol has them, a column at a time; units, up axis and extent of the stage."""

import sys
from types import SimpleNamespace

import numpy as np
import pytest
from fixtures.splat_files import read_usd

from dav_gswt.errors import InputError
from dav_gswt.export import usd
from dav_gswt.export.axes import Y_DOWN, Y_UP, Z_UP, turn_field
from dav_gswt.export.bounds import find_box
from dav_gswt.field import read_field
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


def test_the_stage_knows_where_it_lies_and_how_far_it_reaches(pxr, placed, tmp_path):
    from pxr import Usd, UsdGeom

    usd.write_usd(placed, tmp_path / "a.usdc", AROUND, 1.0)
    stage = Usd.Stage.Open(str(tmp_path / "a.usdc"))
    kept = stage.GetRootLayer().customLayerData
    assert list(kept["origin"]) == FACTS["origin"] and kept["unit"] == "metre"
    assert list(kept["cells"].pop("centre")) == [0, 0.5] and kept["cells"] == FACTS["cells"] | {"radius": 2.0}
    bound = UsdGeom.BBoxCache(Usd.TimeCode.Default(), [UsdGeom.Tokens.default_]).ComputeWorldBound(
        stage.GetDefaultPrim()
    )
    low, high = find_box(placed, Z_UP)
    reach = bound.ComputeAlignedRange()
    assert (np.array(reach.GetMin()) <= low).all() and (np.array(reach.GetMax()) >= high).all()
    np.testing.assert_allclose([reach.GetMin(), reach.GetMax()], [low, high], rtol=1e-6)


def test_its_own_validators_find_nothing(pxr, placed, tmp_path):
    from pxr import Usd, UsdValidation

    usd.write_usd(placed, tmp_path / "a.usdc", FACTS, 1.0)
    validators = UsdValidation.ValidationRegistry().GetOrLoadAllValidators()
    stage = Usd.Stage.Open(str(tmp_path / "a.usdc"))
    errors = UsdValidation.ValidationContext(validators).Validate(stage)
    assert len(validators) > 10 and [error.GetMessage() for error in errors] == []


def test_only_names_of_the_schema_are_written(pxr, placed, tmp_path):
    from pxr import Usd

    usd.write_usd(placed, tmp_path / "a.usdc", FACTS, 1.0)
    stage = Usd.Stage.Open(str(tmp_path / "a.usdc"))
    prim = stage.GetPrimAtPath(usd.PRIM)
    known = Usd.SchemaRegistry().FindConcretePrimDefinition("ParticleField3DGaussianSplat")
    for attribute in prim.GetAuthoredAttributes():
        assert attribute.GetName() in known.GetPropertyNames() and not attribute.IsCustom()
        assert attribute.GetTypeName() == known.GetAttributeDefinition(attribute.GetName()).GetTypeName()


def test_the_same_gaussians_give_the_same_bytes_of_the_announced_size(pxr, field, placed, tmp_path):
    for name in ("a.usdc", "b.usdc"):
        usd.write_usd(placed, tmp_path / name, FACTS, 1.0)
    assert digest_files(tmp_path / "a.usdc") == digest_files(tmp_path / "b.usdc")
    assert (tmp_path / "a.usdc").stat().st_size <= len(field) * usd.BYTES + usd.HEADER_BYTES
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a.usdc", "b.usdc", "spool"]


def test_a_stage_with_y_down_is_refused(pxr, placed, tmp_path):
    with pytest.raises(ValueError, match="y or z up"):
        usd.write_usd(placed, tmp_path / "a.usdc", FACTS, 1.0, Y_DOWN)


def test_without_the_package_the_message_names_the_extra(monkeypatch):
    monkeypatch.setitem(sys.modules, "pxr.Usd", None)
    with pytest.raises(InputError, match=r"exports/terrain: USD needs the extra `usd`, pip install 'usd-core>=26\.3'"):
        usd.find_package()


def test_a_package_older_than_the_schema_is_refused(monkeypatch):
    monkeypatch.setattr(usd.importlib, "import_module", lambda name: SimpleNamespace())
    with pytest.raises(InputError, match="needs the extra `usd`"):
        usd.find_package()


def test_a_terrain_is_what_its_ply_is(pxr, cover_bundle, cover_terrain, export_settings, tmp_path):
    from dav_gswt.export.terrain_files import export_terrain

    settings = export_settings | {"formats": ["ply", "usd"]}
    export_terrain(cover_terrain, cover_bundle.manifest, settings, tmp_path / "out")
    read = turn_field(read_usd(tmp_path / "out/terrain.usdc"), Y_UP)
    wanted = turn_field(read_field(tmp_path / "out/terrain.ply"), Y_UP @ Y_DOWN.T)
    np.testing.assert_array_equal(read.means, wanted.means)
    np.testing.assert_array_equal(read.sh, wanted.sh)
    np.testing.assert_allclose(read.log_scales, wanted.log_scales, atol=1e-5)
    np.testing.assert_allclose(read.quats, wanted.quats, atol=1e-6)
    seen, same = (1 / (1 + np.exp(-f.opacity_logits.astype(float))) for f in (read, wanted))
    np.testing.assert_allclose(seen, same, atol=1e-6)
