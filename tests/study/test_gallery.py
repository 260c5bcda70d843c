import json

import pytest
from fixtures.terrains import two_level_terrain

from dav_gswt.study import gallery


def test_levels_begin_nearer_in_smaller_pictures():
    terrain = two_level_terrain()
    for width, factor in ((480, 0.25), (3840, 1.0)):
        made = gallery.suit_width(terrain, width)
        assert made.switches == [factor * value for value in terrain.switches]
        assert made.bands == [factor * value for value in terrain.bands]


@pytest.mark.parametrize("kind, psnr", [("photos", 31.5), ("synthetic", 30.0)])
def test_a_scene_has_the_bytes_of_all_its_chunks_and_photos_have_their_exposure_fitted(tmp_path, kind, psnr):
    mean = {"psnr": 30.0, "psnr_colour_corrected": 31.5, "ssim": 0.9, "lpips": 0.05}
    metrics = mean | {"groups": {}, "worst_decile": mean, "photos": 16, "gaussians": 9000}
    (tmp_path / "metrics.json").write_text(json.dumps(metrics | {"provenance": {"version": "1.2"}}))
    chunks = [{"chunks": [{"bytes": 2_000_000}]}]
    (tmp_path / "davgswt.json").write_text(json.dumps({"tiles": chunks, "objects": chunks}))
    files = {"metrics": str(tmp_path / "metrics.json"), "manifest": str(tmp_path / "davgswt.json"), "materials": None}
    row = gallery.tabulate_scene({"scene": "my_sand", "kind": kind} | files)
    assert (row["psnr"], row["photos"], row["bundle_mb"], row["version"]) == (psnr, 16, 4.0, "1.2")
    cells = gallery.format_gallery([row], "my_sand", 20.0).splitlines()[-1].split("|")
    assert [float(cell) for cell in cells[2:-1]] == [16, psnr, 0.9, 0.05, 9000, 4.0]
