import json

import pytest

from dav_gswt_study.tradeoff import preset_costs

MEASURED = {  # PSNR, LPIPS, seconds of each job, megabytes of the bundle
    ("sand", "standard"): (30.0, 0.10, 10.0, 20.0),
    ("sand", "draft"): (29.0, 0.15, 5.0, 8.0),
    ("rock", "standard"): (26.0, 0.30, 10.0, 30.0),
    ("rock", "draft"): (26.5, 0.34, 20.0, 10.0),
}


def cell(folder, scene, preset, corrected=False):
    psnr, lpips, seconds, megabytes = MEASURED[scene, preset]
    (place := folder / f"{scene}-{preset}-{corrected}").mkdir()
    mean = {"psnr": psnr, "psnr_colour_corrected": psnr + 1, "ssim": 0.5, "lpips": lpips, "groups": {}}
    mean |= {"worst_decile": {"psnr": 1.0, "psnr_colour_corrected": 1.0}, "photos": 16, "gaussians": 900}
    origin = {"provenance": {"version": "1", "renderer": {"backend": "cpu"}}}
    (place / "metrics.json").write_text(json.dumps(mean | origin))
    parts = [{"bytes": int(megabytes / 2 * 1e6)}] * 2
    (place / "davgswt.json").write_text(json.dumps({"parts": parts}))
    times = {}
    for number, part in enumerate(preset_costs.PARTS):
        (place / f"{part}.tsv").write_text(f"s\tmax_rss\n{seconds}\t{800.0 + number}\n")
        times[part] = [str(place / f"{part}.tsv")] * 2
    files = {"metrics": str(place / "metrics.json"), "manifest": str(place / "davgswt.json")}
    return {"scene": scene, "preset": preset, "corrected": corrected, "times": times, "files": files}


def tabulate(*cells):
    return preset_costs.tabulate_presets(list(cells), 768)


def test_a_row_has_the_sum_of_all_jobs_and_parts(tmp_path):
    (row,) = tabulate(cell(tmp_path, "sand", "standard"))
    assert (row["fits_s"], row["views_s"], row["tiles_s"], row["seconds"]) == (20.0, 20.0, 20.0, 60.0)
    assert (row["bundle_mb"], row["peak_mb"], row["photos"], row["psnr"]) == (20.0, 802.0, 16, 30.0)
    untimed = cell(tmp_path, "sand", "standard", corrected=True)
    untimed["times"]["tiles"] = ["missing.tsv"]
    (row,) = tabulate(untimed)
    assert row["seconds"] is None and row["fits_s"] == 20.0 and row["psnr"] == 31.0


def test_losses_are_to_the_best_preset_of_each_scene(tmp_path):
    rows = tabulate(*(cell(tmp_path, *which) for which in MEASURED))
    mean = preset_costs.summarise_preset(rows, "draft")
    # half and twice as long; 1 dB lost and none, .05 and .04 of LPIPS
    assert mean == pytest.approx({"share": 1.0, "db": 0.5, "most_db": 1.0, "lpips": 0.045, "most_lpips": 0.05})
