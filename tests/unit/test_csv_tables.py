import pytest

from dav_gswt import csv_tables


def test_a_table_holds_five_digits_and_one_without_rows_is_empty(tmp_path):
    csv_tables.write_table(tmp_path / "a.csv", [{"a": 1 / 3, "b": 123456, "c": None, "d": True, "e": "x, y"}, {"a": 2}])
    assert (tmp_path / "a.csv").read_bytes() == b'a,b,c,d,e\n0.33333,123456,,True,"x, y"\n2,,,,\n'
    csv_tables.write_table(tmp_path / "a.csv", [])
    assert (tmp_path / "a.csv").read_bytes() == b""
    with pytest.raises(ValueError, match="not in fieldnames: 'b'"):
        csv_tables.write_table(tmp_path / "a.csv", [{"a": 1}, {"a": 1, "b": 2}])
