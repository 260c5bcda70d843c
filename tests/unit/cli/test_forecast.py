"""What presets will be worth: made-up tables that follow the law, what shrinking costs, tables that cannot be read."""

from dataclasses import replace

import numpy as np
import pytest

from dav_gswt.cli.forecast import (
    LACKING,
    Measured,
    error_to_psnr,
    forecast_presets,
    forecast_slowness,
    leave_one_out,
    measure_shrinking,
    read_front,
)
from dav_gswt.errors import InputError
from dav_gswt.images.image_files import write_png

FITS = {"standard": 1.0, "draft": 1.2, "fine": 0.9}  # error of a fit against the baseline's
BASES = {"sand": 1e-4, "rock": 1e-3, "leaves": 5e-3}  # error of the baseline's fit
LOST = {"sand": 2e-4, "rock": 1e-3, "leaves": 0.0}  # what photos lose by the size of `draft`


def row(scene, preset, **changes):
    lost = LOST[scene] if preset == "draft" else 0.0
    psnr = error_to_psnr(BASES[scene] * FITS[preset] + LACKING * lost)
    lpips = 0.1 + (0.05 if lost else 0.02) * (preset == "draft")
    made = Measured(scene, preset, 768, psnr, lpips, lost, gaussians=1e5, bundle_mb=10.0, seconds=60.0, estimated=60.0)
    return replace(made, **changes)


@pytest.fixture
def front():
    return [row(scene, preset) for scene in BASES for preset in FITS]


def test_a_scene_with_a_known_run_is_forecast_exactly_where_the_law_holds(front):
    off = leave_one_out(front, "draft")
    assert len(off) == len(front)
    assert max(abs(each.off) for each in off) < 1e-9
    made = row("sand", "draft", shrinking=1.0)
    assert 0 < made.fit_error < 10 ** (-made.psnr / 10)


def test_without_a_run_what_shrinking_costs_tells_the_level(front):
    found = forecast_presets(front, {"standard": 0.0, "draft": 2e-4})
    # the geometric mean of 1e-4 / 2e-4 and 1e-3 / 1e-3 times 2e-4
    assert found["standard"].psnr == pytest.approx(error_to_psnr(np.sqrt(0.5) * 2e-4))


def test_lpips_is_that_of_scenes_whose_photos_are_shrunk_alike(front):
    found = forecast_presets(front, dict.fromkeys(FITS, 0.0))
    assert found["draft"].lpips == pytest.approx(0.02)
    assert found["fine"].loss == 0 and found["draft"].loss == pytest.approx(10 * np.log10(1.2 / 0.9))  # of the fits
    assert forecast_presets(front, dict.fromkeys(FITS, 0.0) | {"draft": 1e-4})["draft"].lpips == pytest.approx(0.05)


def test_a_preset_takes_longer_by_the_geometric_mean_of_its_scenes(front):
    times = {"sand": 60.0, "rock": 240.0, "leaves": np.nan}
    made = [replace(each, seconds=times[each.scene] if each.preset == "draft" else 60.0) for each in front]
    assert forecast_slowness(made) == pytest.approx({"standard": 1, "draft": 2, "fine": 1})


def test_a_run_that_took_longer_than_others_of_its_preset_makes_all_take_longer(front):
    made = [replace(each, seconds=120.0) for each in front]
    assert forecast_slowness(made, ("draft", 3.0)) == pytest.approx(dict.fromkeys(FITS, 3.0))
    for known in (None, ("draft", None), ("mine", 3.0)):
        assert forecast_slowness(made, known) == pytest.approx(dict.fromkeys(FITS, 2.0))


def test_seconds_are_forecast_from_the_other_scenes(front):
    slow = [replace(each, seconds=120.0) if each.scene == "sand" else each for each in front]
    before, after = ({(e.scene, e.preset): e.late for e in leave_one_out(slow, k)} for k in (None, "draft"))
    assert before["sand", "fine"] == pytest.approx(-0.5)
    assert before["rock", "fine"] == pytest.approx(np.sqrt(2) - 1)
    assert after["sand", "fine"] == pytest.approx(0) and after["rock", "fine"] == pytest.approx(0)
    untimed = [replace(each, seconds=np.nan) for each in front]
    assert {each.late for each in leave_one_out(untimed)} == {None}


def test_shrinking_costs_what_the_photos_show(tmp_path):
    write_png(tmp_path / "grey.png", np.full((64, 64, 3), 0.5))
    checks = np.indices((64, 64)).sum(0)[..., None] % 2 * np.ones(3)
    write_png(tmp_path / "checks.png", checks)
    assert measure_shrinking([tmp_path / "grey.png"], [32], 64) == {32: 0.0}
    found = measure_shrinking([tmp_path / "checks.png"], [32, 64, 128], 64)
    assert found == {32: pytest.approx(0.25, abs=1e-4), 64: 0, 128: 0}
    # photos count at the size of the table: blocks of 4 are a checkerboard at 16 pixels, of which 8 keep nothing
    write_png(tmp_path / "blocks.png", np.kron(checks[:16, :16, 0], np.ones((4, 4)))[..., None] * np.ones(3))
    assert measure_shrinking([tmp_path / "blocks.png"], [8], 16) == {8: pytest.approx(0.25, abs=1e-4)}


@pytest.mark.parametrize("text", [None, "scene,preset\na,b\n"])
def test_a_table_that_cannot_be_read_is_named(tmp_path, text):
    if text is not None:
        (tmp_path / "t.csv").write_text(text)
    with pytest.raises(InputError, match=r"t\.csv: not the table of presets; `snakemake preset_costs` makes it"):
        read_front(tmp_path / "t.csv")
