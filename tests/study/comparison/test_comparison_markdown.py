"""The page about view selection: its tables, and that they are those of the data beside it."""

from pathlib import Path

import pytest
from fixtures.markdown import collapse_spaces

from dav_gswt.study import csv_tables
from dav_gswt.study.comparison import curves, markdown, tables
from dav_gswt.study.markdown import render_template

ROOT = Path(__file__).parents[4]
COUNTS = ("wins", "ties", "losses")


def row(policy, scene, k, mean, low=None, high=None, counts=(1, 0, 2)):
    about = {"measure": "psnr", "policy": policy, "scene": scene, "k": k, "units": sum(counts)}
    return about | {"mean": mean, "low": low, "high": high} | dict(zip(COUNTS, counts, strict=True))


COMPARED = [
    row("random", "every", "", -0.123, -0.2, 0.01),
    row("random", "sand_pool", 4, -0.123, -0.2, 0.01),
    row("diverse", "every", "", 0.051, -0.0, 0.1, (2, 1, 0)),
    row("diverse", "grass_pool", 2, 0.049),
    row("diverse", "every", "", 0.0123, 0.001, 0.02) | {"measure": "lpips"},
]


def test_scenes_are_rows_and_the_best_policy_comes_first():
    head, rule, *rows = collapse_spaces(markdown.format_scenes(COMPARED, "farthest")).splitlines()
    assert set(rule) == set("|-")
    assert [head, *rows] == [
        "| less `farthest`, dB | `diverse` | `random` |",
        "| grass_pool, 2 a round | +0.05 | |",
        "| sand_pool, 4 a round | | -0.12 (-0.20, +0.01) |",
    ]


def test_groups_have_a_row_a_policy_and_intervals_where_there_are_some():
    grouped = [each | {"group": "paths"} for each in COMPARED if each["scene"] == "every"]
    _, _, *rows = collapse_spaces(markdown.format_groups(grouped)).splitlines()
    assert rows == [
        "| paths | `random` | 3 | -0.12 (-0.20, +0.01) | | | | 1, 0, 2 |",
        "| paths | `diverse` | 3 | +0.05 (-0.00, +0.10) | | | +0.0123 (+0.0010, +0.0200) | 2, 1, 0 |",
    ]


def test_ends_are_means_over_starts():
    about = {"scene": "sand", "policy": "random", "k": 4, "photos": 20, "walker_psnr": None}
    results = [about | {"psnr": psnr, "lpips": 0.25, "gap": gap} for psnr, gap in ((20.0, 1.0), (21.0, None))]
    (line,) = collapse_spaces(markdown.format_ends(results)).splitlines()[2:]
    assert line == "| sand | `random` | 2 | 20 | 20.50 | | 0.250 | 1.00 |"


@pytest.mark.parametrize(("table", "claims"), [("view", True), ("development", False)])
def test_only_what_was_not_developed_on_is_said_to_be_so(table, claims):
    grouped = [each | {"group": "paths"} for each in COMPARED if each["scene"] == "every"]
    rounds = [{"version": "1", "renderer": "cpu"}]
    values = markdown.describe_comparison(rounds, [], COMPARED, grouped, [], "farthest")
    text = render_template(ROOT / "workflow/report/view_selection.md", values | {"table": table})
    assert f"{table}_curves.csv" in text and f"{table}_budget.png" in text
    assert ("Nothing was chosen on these scenes." in text) == ("copr_dunes" in text) == claims


@pytest.fixture(params=["view", "hundred"])
def published(request):
    return request.param


@pytest.fixture
def page(published):
    return (ROOT / f"docs/research/results/{published}-selection.md").read_text(encoding="utf-8")


def test_the_page_shows_the_data_beside_it(page, published):
    results = tables.summarise_cells(curves.read_curves(ROOT / f"docs/research/data/{published}_curves.csv"))
    assert markdown.format_scenes(tables.compare_to_baseline(results, "farthest"), "farthest") in page
    assert markdown.format_ends(results) in page


def test_the_page_names_the_version_of_every_cell(page, published):
    versions = {each["version"] for each in csv_tables.read_table(ROOT / f"docs/research/data/{published}_curves.csv")}
    assert all(f"version {version}," in page for version in versions)
