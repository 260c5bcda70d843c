"""The page and the figure of numerical stability are made from the tables alone."""

import pytest
from fixtures.markdown import collapse_spaces

from dav_gswt.images import image_files
from dav_gswt.study import csv_tables
from dav_gswt.study.stability import page, plots

FACTS = {"version": "0.1.0", "renderer": {"backend": "cpu", "instruction_set": "x86-64-v3"}}


@pytest.fixture
def formulas(tmp_path):
    good = {"group": "Seams", "formula": "a|b", "source": "Eq. (a)", "range": "0 to 1", "type": "float32"}
    good |= {
        "finite": True,
        "absolute_error": 1e-7,
        "relative_error": 0.0,
        "worst_at": "x = 1",
        "share_of_tolerance": 0.25,
    }
    good |= {"printed_share_of_tolerance": 2e9, "printed_at": "x = 0", "printed_gives": "-131072", "printed_right": "1"}
    bad = good | {"formula": "broken", "share_of_tolerance": 3.0, "printed_share_of_tolerance": None}
    csv_tables.write_table(tmp_path / "formulas.csv", [good, bad])
    return csv_tables.read_table(tmp_path / "formulas.csv")


@pytest.fixture
def runs(tmp_path):
    good = {
        "run": "a",
        "about": "one Gaussian",
        "as_expected": True,
        "exit_code": 1,
        "message": "too few",
        "seconds": 4.2,
    }
    good |= {"traceback": False, "files_checked": 0, "not_finite": 0, "like": None, "stills_psnr": None}
    good |= {"warnings": "", "gaussians": None, "peak_mb": 169}
    bad = good | {
        "about": "a world",
        "as_expected": False,
        "exit_code": 0,
        "not_finite": 2,
        "like": "b",
        "stills_psnr": 52.4,
    }
    csv_tables.write_table(tmp_path / "runs.csv", [good, bad])
    return csv_tables.read_table(tmp_path / "runs.csv")


def test_the_page_says_what_held_and_what_did_not(root, tmp_path, formulas, runs):
    page.write_stability_page(tmp_path / "a.md", root / "workflow/report/stability.md", formulas, runs, FACTS)
    text = collapse_spaces((tmp_path / "a.md").read_text())
    assert "renderer cpu, x86-64-v3. 1 of 2 formulas stay within" in text and "1 of 2 runs ended as expected" in text
    assert "| a\\|b | x = 0 | -131072 | 1 | 1e-07 |" in text
    assert "| x = 1 | 0.25 |" in text and "| x = 1 | **3** |" in text
    assert '| one Gaussian | stopped: "too few" | yes | | 4 | 169 |' in text
    assert "2 with numbers that are not finite; stills equal those of b to 52 dB | **no** |" in text


def test_the_figure_is_a_picture_and_the_same_each_time(tmp_path, formulas):
    for name in ("a.png", "b.png"):
        plots.write_tolerance_plot(tmp_path / name, formulas)
    assert (tmp_path / "a.png").read_bytes() == (tmp_path / "b.png").read_bytes()
    assert image_files.read_photo(tmp_path / "a.png").std() > 0.05
