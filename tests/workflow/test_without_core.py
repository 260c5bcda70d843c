"""The workflow where PyTorch draws."""

import shutil

import pytest
from fixtures.runs import TINY, USUAL

from dav_gswt.files import read_json


def test_torch_fits_the_coarse_field_as_well_as_the_core(snakemake, tiny, tmp_path):
    """The same photos, steps and seed; float32 sums in another order send the two fits slightly different ways."""
    folder = tmp_path / "run"
    shutil.copytree(tiny.folder, folder)
    coarse = folder / tiny.coarse.relative_to(tiny.folder)
    shutil.rmtree(coarse)
    wanted = str((coarse / "metrics.json").relative_to(folder))
    snakemake(folder, "--cores", "2", wanted, configs=(USUAL, TINY), env={"DAV_GSWT_BACKEND": "torch"})
    found, core = read_json(coarse / "metrics.json"), read_json(tiny.coarse / "metrics.json")
    assert found["provenance"]["renderer"]["backend"] == "torch"
    assert found["psnr"] == pytest.approx(core["psnr"], abs=0.5)
