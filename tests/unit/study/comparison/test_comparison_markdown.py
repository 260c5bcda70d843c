"""The comparison as a table to read, and the copy of it in the page about view selection."""

from pathlib import Path

from fixtures.markdown import collapse_spaces

from dav_gswt.study.comparison import markdown

ROOT = Path(__file__).parents[4]


def row(policy, scene, k, mean, low=None, high=None, counts=(1, 0, 2)):
    about = {"measure": "psnr", "policy": policy, "scene": scene, "k": k}
    return about | {"mean": mean, "low": low, "high": high} | dict(zip(("wins", "ties", "losses"), counts, strict=True))


def test_best_first_with_intervals_where_there_are_some():
    compared = [
        row("random", "every", "", -0.123, -0.2, 0.01),
        row("random", "sand_pool", 4, -0.123, -0.2, 0.01),
        row("diverse", "every", "", 0.051, -0.0, 0.1, (2, 1, 0)),
        row("diverse", "grass_pool", 2, 0.049),
        row("diverse", "every", "", 0.0123, 0.001, 0.02) | {"measure": "lpips"},
    ]
    text = markdown.format_comparison(compared, "farthest")
    by_scene, by_measure = text.split("\n\n")
    assert collapse_spaces(by_measure).splitlines()[2:] == [
        "| `diverse` | +0.05 (-0.00, +0.10) | | | +0.0123 (+0.0010, +0.0200) |",
        "| `random` | -0.12 (-0.20, +0.01) | | | |",
    ]
    head, rule, *rows = collapse_spaces(by_scene).splitlines()
    assert set(rule) == set("|-")
    assert [head, *rows] == [
        "| less `farthest`, dB | grass, 2 a round | sand, 4 a round | wins, ties, losses |",
        "| `diverse` | +0.05 | | 2, 1, 0 |",
        "| `random` | | -0.12 (-0.20, +0.01) | 1, 0, 2 |",
    ]


def test_the_page_shows_the_table_that_the_rule_made():
    made = (ROOT / "docs/research/data/view_comparison.md").read_text(encoding="utf-8")
    assert made in (ROOT / "docs/research/results/view-selection.md").read_text(encoding="utf-8")
