"""Tables: types of columns, the format of files, rows that are added and replaced."""

from pathlib import Path

import pytest

from dav_gswt.study import csv_tables

COMMITTED = sorted(Path(__file__).parents[3].glob("docs/**/*.csv"))


def test_read_table_returns_the_numbers_that_were_written(tmp_path):
    rows = [{"seconds": 1.5, "step": 25, "psnr": 30.125}, {"seconds": 2.5, "step": 50, "psnr": None}]
    csv_tables.write_table(tmp_path / "a.csv", rows)
    assert csv_tables.read_table(tmp_path / "a.csv", numbers=["seconds", "psnr"], integers=["step"]) == rows


def test_floats_have_five_significant_digits_and_other_values_are_text(tmp_path):
    csv_tables.write_table(tmp_path / "a.csv", [{"a": 1 / 3, "b": 123456, "c": None, "d": True, "e": "x, y"}])
    assert (tmp_path / "a.csv").read_bytes() == b'a,b,c,d,e\n0.33333,123456,,True,"x, y"\n'


def test_texts_leaves_all_other_columns_numbers(tmp_path):
    csv_tables.write_table(tmp_path / "a.csv", [{"name": "1", "value": 2, "other": None}])
    assert csv_tables.read_table(tmp_path / "a.csv", texts=["name"]) == [{"name": "1", "value": 2.0, "other": None}]


def test_words_of_missing_values_stay_text(tmp_path):
    csv_tables.write_table(tmp_path / "a.csv", [{"prior": "none", "policy": "NA"}])
    assert csv_tables.read_table(tmp_path / "a.csv") == [{"prior": "none", "policy": "NA"}]


def test_a_table_without_rows_is_an_empty_file(tmp_path):
    csv_tables.write_table(tmp_path / "a.csv", [])
    assert (tmp_path / "a.csv").read_bytes() == b""
    assert csv_tables.read_table(tmp_path / "a.csv") == []


def test_a_missing_file_has_no_rows_only_if_that_is_allowed(tmp_path):
    assert csv_tables.read_table(tmp_path / "a.csv", missing_ok=True) == []
    with pytest.raises(FileNotFoundError):
        csv_tables.read_table(tmp_path / "a.csv")


def test_a_column_that_the_first_row_lacks_is_an_error(tmp_path):
    with pytest.raises(ValueError, match="no column b"):
        csv_tables.write_table(tmp_path / "a.csv", [{"a": 1}, {"a": 1, "b": 2}])


def test_update_table_adds_rows_and_replaces_those_with_the_same_key(tmp_path):
    path, key = tmp_path / "kept.csv", ("scene", "seed")
    old = [{"scene": "a", "seed": 0, "value": 1.0}, {"scene": "b", "seed": 0, "value": 2.0}]
    csv_tables.update_table(path, old, key)
    csv_tables.update_table(path, [{"scene": "b", "seed": 0, "value": 3.0, "more": 1}], key)
    found = [(row["scene"], row["value"], row["more"]) for row in csv_tables.read_table(path, numbers=["value"])]
    assert found == [("a", 1.0, ""), ("b", 3.0, "1")]


@pytest.mark.parametrize("path", COMMITTED, ids=lambda path: path.name)
def test_a_committed_table_keeps_its_bytes_when_it_is_read_and_written(path, tmp_path):
    csv_tables.write_table(tmp_path / "again.csv", csv_tables.read_table(path))
    assert (tmp_path / "again.csv").read_bytes() == path.read_bytes()
