import json

import pytest

from dav_gswt.sweeps import TILES, TIMES
from dav_gswt_study import csv_tables
from dav_gswt_study import sweeps as tables
from dav_gswt_study.seams import measure

CELL = dict(
    sweep="tau", scene="desert", seed=0, preset="draft", policy="farthest", prior="none", p_drop="0", lam="0", k=4,
    rounds=2, tiling="semantic", tau="0.6", samples=0, steps=0, corrected=False, varied={"tau": 0.6},
)  # fmt: skip
ORIGIN = {"version": "1", "renderer": {"backend": "cpu", "isa": "x"}, "inputs": {"field": "f" * 64, "seams": "t" * 64}}


def metrics(folder):
    mean = {"psnr": 20.0, "psnr_colour_corrected": 21.0, "ssim": 0.5, "lpips": 0.25, "groups": {}}
    mean |= {"worst_decile": {"psnr": 15.0, "psnr_colour_corrected": 16.0}, "photos": 16, "gaussians": 9}
    (path := folder / "metrics.json").write_text(json.dumps(mean | {"provenance": ORIGIN}))
    return str(path)


def manifest(folder):
    deep = {"uncertainty": 0.8, "orders": [0, 1, 2], "chunks": [{"count": 10}, {"count": 2}]}
    shallow = {"uncertainty": 0.2, "orders": [0, 2], "chunks": [{"count": 4}, {"count": 1}]}
    manifest = {"tiles": [deep, shallow], "levels": [{}, {}], "directions": [0, 1, 2], "provenance": ORIGIN}
    manifest["parts"] = [{"bytes": 800_000}, {"bytes": 50_000}]
    (path := folder / "davgswt.json").write_text(json.dumps(manifest))
    return str(path)


def crops(folder):
    at = {"view": "top", "ground": "flat", "psnr": 30.0, "jump": 1.5}
    rows = [
        at | {"place": place, "crop": n, "cluster": str(n), "seam_lpips": value + n / 100}
        for n in range(4)
        for place, value in (("cut", 0.3), ("floor", 0.1))
    ]
    csv_tables.write_table(folder / "crops.csv", [{key: row[key] for key in measure.COLUMNS} for row in rows])
    (folder / "facts.json").write_text(json.dumps({"dense": 0.4, "provenance": ORIGIN}))
    return {"crops": str(folder / "crops.csv"), "facts": str(folder / "facts.json")}


def test_a_row_holds_what_was_measured_and_where_it_comes_from_and_photos_have_their_exposure_fitted(tmp_path):
    files = {"metrics": metrics(tmp_path), "manifest": manifest(tmp_path)} | crops(tmp_path)
    row = tables.tabulate_experiment(CELL | {"files": files, "times": {}})
    assert (row["psnr"], row["worst_psnr"], row["photos"], row["psnr_is"]) == (20, 15, 16, "raw")
    assert (row["uncertainty"], row["deep"], row["levels"], row["splats"]) == (0.5, 0.5, 2, 17)
    assert row["bundle_mb"] == 0.85
    assert row["seam_lpips"] == pytest.approx(0.2) and row["seam_density"] == 0.4 and row["seam_psnr"] == 30
    assert (row["field"], row["tiles"], row["renderer"]) == (12 * "f", 12 * "t", "cpu x")

    row = tables.tabulate_experiment(CELL | {"corrected": True, "files": {"metrics": metrics(tmp_path)}, "times": {}})
    assert (row["psnr"], row["worst_psnr"], row["psnr_is"]) == (21, 16, "colour-corrected")
    assert not [row[key] for key in (*TILES, *tables.SEAMS, *TIMES) if row[key] is not None]
