import numpy as np
import pytest
from fixtures.splats import rough_ground
from fixtures.tile_sets import report_of

from dav_gswt.bundle import build, store
from dav_gswt.bundle.content import BundleContent
from dav_gswt.tiles.build import TileSet
from dav_gswt_study.terrain import presort

SIDE = 4.0


def content_of(levels) -> BundleContent:
    fields = [[rough_ground(tile, 32 >> level, SIDE) for tile in range(16)] for level in range(levels)]
    labels, shifts = np.zeros((16, 32, 32), np.uint8), np.zeros((16, 9, 2), int)
    return BundleContent.of_one_material(TileSet(SIDE, SIDE / 32, fields, labels, shifts, np.zeros(16), report_of()))


@pytest.fixture
def bundled(monkeypatch, tmp_path, root):
    """Write content as a bundle; pictures are small."""
    monkeypatch.setattr(presort, "WIDTH", 64)
    monkeypatch.setattr(presort, "HEIGHT", 36)
    monkeypatch.setattr(presort, "REACH", 11)
    monkeypatch.setattr(presort, "VIEWS", presort.VIEWS[:2])

    def write(content, **more):
        build.write_bundle(content, tmp_path / "bundle", build.BundleOptions(tau=1.0, **more), {})
        return store.read_bundle(tmp_path / "bundle")

    return write


def of(rows, shortcut):
    return {row["view"]: row["psnr"] for row in rows if row["shortcut"] == shortcut}


def test_every_shortcut_has_a_price_of_its_own(bundled):
    content = content_of(2)
    # coarse discs begin where one is twelve pixels wide: within what is placed
    rows = presort.measure_approximations(content, bundled(content, level_pixels=12.0))
    assert all(20 < r["psnr"] < 100 for r in rows if r["psnr"] is not None)
    assert min(of(rows, "rounding").values()) > 45
    assert of(rows, "levels")["walker"] < of(rows, "rounding")["walker"], "coarse discs are seen, rounding is not"
    for view, found in of(rows, "all").items():
        assert found < 3 + min(v for s in presort.APPROXIMATIONS[:-1] if (v := of(rows, s).get(view)) is not None)
