"""The table and the figure of several calibrations."""

import csv

import pytest

from dav_gswt.images import image_files
from dav_gswt.study import csv_tables
from dav_gswt.study.calibration import report

NONE = dict.fromkeys(report.MEASURES)


def cell(scene="dunes", number=0):
    return dict(scene=scene, seed=0, preset="draft", policy="farthest", prior="none", p_drop="0", round=number)


def judged(rank, pixels=None):
    """A score that is as good as `rank` says."""
    found = {"spearman": rank, "ause": 0.2 - 0.1 * rank, "ause_chance": 0.2, "coverage": 0.91, "width": 0.05}
    if pixels is not None:
        found |= {"pixel_spearman": pixels, "pixel_ause": 0.5 - 0.2 * pixels, "pixel_ause_chance": 0.5}
    return found


def table():
    cells = [cell("dunes", 0), cell("dunes", 1), cell("beach", 0)]
    poor, good, best = judged(0.1, pixels=0.3), judged(0.5, pixels=0.4), judged(0.8, pixels=0.6)
    scores = [{"poor": poor, "best": good}, {"poor": poor, "best": best}, {"poor": poor, "dumb": NONE}]
    return report.tabulate_scores(cells, [{"poses": 40, "level": 0.9, "scores": one} for one in scores])


def dots(axes):
    return sorted(
        (float(x), float(y)) for line in axes.lines if line.get_marker() != "None" for x, y in line.get_xydata()
    )


def bars(axes):
    return sorted(float(path.vertices[0, 0]) for bar in axes.collections for path in bar.get_paths())


def test_the_table_has_a_row_for_each_score_of_each_cell(tmp_path):
    made = table()
    assert [(row["scene"], row["round"], row["score"]) for row in made] == [
        ("dunes", 0, "poor"), ("dunes", 0, "best"), ("dunes", 1, "poor"), ("dunes", 1, "best"),
        ("beach", 0, "poor"), ("beach", 0, "dumb"),
    ]  # fmt: skip
    csv_tables.write_table(tmp_path / "a.csv", made)
    with (tmp_path / "a.csv").open(newline="") as file:
        back = list(csv.DictReader(file))
    wanted = "scene seed preset policy prior p_drop round score poses spearman ause coverage width pixel_spearman"
    assert set(wanted.split()) | {"pixel_ause"} <= set(back[0])
    assert back[3]["spearman"] == "0.8" and back[3]["poses"] == "40" and back[5]["spearman"] == ""
    with pytest.raises(ValueError):
        report.tabulate_scores([cell()], [])


def test_the_figure_shows_each_value_its_mean_and_chance_the_best_score_on_top():
    figure = report.draw_figure(table(), 0.9)
    spearman, ause, coverage, by_pixel = figure.axes[:4]
    assert [text.get_text() for text in spearman.get_yticklabels()] == ["best", "poor", "dumb"]
    assert [text.get_text() for text in by_pixel.get_yticklabels()] == ["best", "poor"]
    assert [x for x, _ in dots(spearman)] == pytest.approx([0.1, 0.1, 0.1, 0.5, 0.8])
    assert [round(y) for _, y in dots(spearman)] == [1, 1, 1, 0, 0]
    assert spearman.get_ylim()[0] > spearman.get_ylim()[1]  # the first row is on top
    assert bars(spearman) == pytest.approx([0.1, 0.65])
    assert bars(ause) == pytest.approx([0.135, 0.19, 0.2, 0.2]) and bars(by_pixel) == pytest.approx([0.3, 0.5])
    assert any(line.get_xdata()[0] == 0.9 == line.get_xdata()[1] for line in coverage.lines)
    low, high = spearman.get_xlim()
    assert low < 0 and high > 1
    named = {text.get_text() for text in figure.legends[0].get_texts()}
    assert {"dunes", "beach", "round 0", "round 1", "mean", "chance"} == named


def test_colours_are_scenes_and_marks_are_rounds():
    found = {(line.get_color(), line.get_marker()) for line in report.draw_figure(table(), 0.9).axes[0].lines}
    found = {(colour, mark) for colour, mark in found if mark in report.MARKS}
    assert len(found) == 3 and len({colour for colour, _ in found}) == len({mark for _, mark in found}) == 2


def test_without_pixels_or_intervals_the_figure_says_what_it_can():
    scores = {"a": judged(0.4) | {"coverage": None, "width": None}}
    figure = report.draw_figure(report.tabulate_scores([cell()], [{"poses": 12, "level": 0.9, "scores": scores}]), 0.9)
    assert len(figure.axes) == 3 and [text.get_text() for text in figure.axes[2].texts] == ["too few poses"]


def test_the_figure_is_wide_enough_to_read_and_the_same_each_time(tmp_path):
    for name in ("a.png", "b.png"):
        report.write_figure(tmp_path / name, table(), 0.9)
    assert (tmp_path / "a.png").read_bytes() == (tmp_path / "b.png").read_bytes()
    assert image_files.read_size(tmp_path / "a.png")[0] >= 1200
