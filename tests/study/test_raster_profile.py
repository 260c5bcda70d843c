"""Where the rasterizer's time goes, on a small field."""

from dataclasses import replace

import pytest
from fixtures import ground as made

from dav_gswt.images import image_files
from dav_gswt.raster import backends
from dav_gswt.study import markdown

if why := backends.explain_unavailable("cpu"):
    pytest.skip(f"cpu: {why}", allow_module_level=True)

from dav_gswt.raster import cpu
from dav_gswt.study import raster_profile


@pytest.fixture(scope="module")
def rows():
    return raster_profile.profile_rasterizer(made.field(), replace(made.FRAME, kind="synthetic"), 96)


def test_there_is_a_row_for_each_instruction_set_and_number_of_threads(rows):
    assert [(row["instructions"], row["threads"]) for row in rows] == [
        (name, count) for name in cpu.instruction_sets() for count in (1, 2)
    ]


def test_every_stage_takes_time_and_blending_is_below_the_peak(rows):
    for row in rows:
        assert len(raster_profile.stage_columns(rows)) == 9
        assert all(row[column] >= 0 for column in raster_profile.stage_columns(rows))
        assert row["blend_ms"] > 0 and row["blend_backward_ms"] > 0
        assert 0 < row["share"] < row["share_blending"] < 1


def test_all_rows_blend_the_same_pairs(rows):
    assert rows[0]["pairs"] > 96 * 96
    assert all(row["pairs"] == pytest.approx(rows[0]["pairs"], rel=1e-3) for row in rows)


def test_the_page_and_the_figure_are_made(rows, tmp_path, root):
    raster_profile.plot_stages(rows, tmp_path / "stages.png")
    assert image_files.read_photo(tmp_path / "stages.png").std() > 0.01
    values = raster_profile.describe_profile(rows) | {"version": "1.0", "cores": 2, "processor": "a processor"}
    text = markdown.render_template(root / "workflow/report/rasterizer.md", values)
    assert "2 cores of a processor" in text and f"| {rows[0]['instructions']}" in text
