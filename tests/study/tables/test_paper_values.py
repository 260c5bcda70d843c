"""The paper's values as they are printed, and what its own numbers say."""

import json
import re

import pytest

from dav_gswt.study.statistics import two_sided_p
from dav_gswt.study.tables import paper


def test_every_value_is_printed_in_the_papers_table(root):
    """tests/golden/paper_tables.json: the numbers of the paper's tables, and of the protocol in its text."""
    printed = json.loads((root / "tests/golden/paper_tables.json").read_text(encoding="utf-8"))
    for where, value in paper.read_paper().items():
        assert set(re.findall(r"\d+(?:\.\d+)?", value)) <= set(printed[where[0]]), where


def test_rows_stand_beside_ours_and_are_empty_where_the_paper_has_none():
    assert paper.find_printed("ablation", "w2", ("psnr", "p")) == {"paper_psnr": "29.12±0.09", "paper_p": "0.006"}
    assert paper.find_printed("timing", "copr_dunes", ("cut_s",)) == {"paper_cut_s": None}
    levels = paper.find_printed("lod", "desert", ("scale5", "count0"))
    assert levels == {"paper_scale5": "0.2023", "paper_count0": "64.2K"}


@pytest.mark.parametrize("printed, value", [("29.41±0.08", 29.41), ("64.2K", 64200), ("<0.001", 0.001), ("60.6", 60.6)])
def test_numbers_are_read_as_printed(printed, value):
    assert paper.parse_number(printed) == pytest.approx(value)


def test_the_papers_t_value_is_not_below_one_per_cent():
    assert two_sided_p(4.28, 4) == pytest.approx(0.0129, abs=1e-4)
    with pytest.raises(ValueError, match="no number"):
        paper.parse_number("—")
