import pytest

from dav_gswt_study import csv_tables


def test_a_table_gives_back_numbers_texts_and_missing_values(tmp_path):
    rows = [{"seconds": 1.5, "step": 25, "psnr": 30.125}, {"seconds": 2.5, "step": 50, "psnr": None}]
    csv_tables.write_table(tmp_path / "a.csv", rows)
    assert csv_tables.read_table(tmp_path / "a.csv", numbers=["seconds", "psnr"], integers=["step"]) == rows
    csv_tables.write_table(tmp_path / "a.csv", [{"name": "none", "value": 2, "other": None}])
    assert csv_tables.read_table(tmp_path / "a.csv", texts=["name"]) == [{"name": "none", "value": 2.0, "other": None}]


def test_a_file_without_rows_is_read(tmp_path):
    csv_tables.write_table(tmp_path / "a.csv", [])
    assert csv_tables.read_table(tmp_path / "a.csv") == csv_tables.read_table(tmp_path / "b.csv", missing_ok=True) == []
    with pytest.raises(FileNotFoundError):
        csv_tables.read_table(tmp_path / "b.csv")


def test_update_table_adds_rows_and_replaces_those_with_the_same_key(tmp_path):
    path, key = tmp_path / "kept.csv", ("scene", "seed")
    old = [{"scene": "a", "seed": 0, "value": 1.0}, {"scene": "b", "seed": 0, "value": 2.0}]
    csv_tables.update_table(path, old, key)
    csv_tables.update_table(path, [{"scene": "b", "seed": 0, "value": 3.0, "more": 1}], key)
    found = [(row["scene"], row["value"], row["more"]) for row in csv_tables.read_table(path, numbers=["value"])]
    assert found == [("a", 1.0, ""), ("b", 3.0, "1")]
