import threading
from pathlib import Path

import pytest

from dav_gswt import files
from dav_gswt.errors import InputError
from dav_gswt.files import atomic_file, atomic_folder, digest_files
from dav_gswt.provenance import record_provenance
from dav_gswt.threads import map_ahead


def test_an_output_that_fails_leaves_what_was_there(tmp_path):
    target = tmp_path / "a.txt"
    target.write_text("old")
    with pytest.raises(OSError, match="full"), atomic_file(target) as part:
        part.write_text("half")
        raise OSError("disk full")
    assert [p.name for p in tmp_path.iterdir()] == ["a.txt"]
    assert target.read_text() == "old"


def test_json_has_no_nan(tmp_path):
    with pytest.raises(ValueError, match="not JSON compliant"):
        files.write_json(tmp_path / "a.json", {"x": float("nan")})
    assert not list(tmp_path.iterdir())
    for text in ("{", "[NaN]", "[1e999]", f"[{'1' * 301}]"):
        (tmp_path / "a.json").write_text(text)
        with pytest.raises(InputError, match=r"a\.json: not readable as JSON"):
            files.read_json(tmp_path / "a.json")


@pytest.mark.parametrize("write", [atomic_file, atomic_folder])
def test_a_full_disk_is_told_with_the_name_of_what_was_written(tmp_path, write):
    """The system's calls on open files know no name."""
    with pytest.raises(OSError) as full, write(tmp_path / "field"):
        raise OSError(28, "No space left on device")
    assert full.value.filename == str(tmp_path / "field") and full.value.errno == 28
    assert not list(tmp_path.iterdir())


def test_a_folder_comes_back_if_its_replacement_cannot_be_moved_in(tmp_path):
    target = tmp_path / "set"
    target.mkdir()
    (target / "a").write_text("old")
    with pytest.raises(OSError), atomic_folder(target) as part:
        (part / "a").write_text("new")
        part.rename(tmp_path / "gone")  # so that the last step fails, after the old folder was moved away
    assert (target / "a").read_text() == "old"
    assert not [p for p in tmp_path.iterdir() if p.name.startswith(".")]


def test_a_folder_that_a_killed_run_had_moved_away_is_not_lost(tmp_path):
    (tmp_path / ".set.old").mkdir()
    (tmp_path / ".set.old" / "a").write_text("old")
    with pytest.raises(RuntimeError), atomic_folder(tmp_path / "set"):
        raise RuntimeError
    assert (tmp_path / "set" / "a").read_text() == "old"


def test_a_link_stays_a_link_to_the_folder_that_is_replaced(tmp_path):
    (tmp_path / "far").mkdir()
    (tmp_path / "near").symlink_to(tmp_path / "far")
    for text in ("one", "two"):
        with atomic_folder(tmp_path / "near") as part:
            (part / "a").write_text(text)
    assert (tmp_path / "near").is_symlink() and (tmp_path / "far/a").read_text() == "two"
    assert sorted(p.name for p in tmp_path.iterdir()) == ["far", "near"]


def test_a_path_of_the_config_may_lie_below_the_home_or_the_repository(tmp_path, monkeypatch):
    monkeypatch.setenv("HOME", str(tmp_path))
    (tmp_path / "photos").mkdir()
    assert files.locate_path("~/photos") == tmp_path / "photos"
    monkeypatch.chdir(tmp_path)
    assert files.locate_path("photos") == Path("photos")
    assert files.locate_path("config/config.yaml") == files.REPOSITORY / "config/config.yaml"
    for same in ("nowhere", "~no-such-user/x"):
        assert files.locate_path(same) == Path(same)
    assert [files.locate_path(name, tmp_path) for name in ("photos", "config")] == [Path("photos"), Path("config")]


def test_the_provenance_of_a_folder_is_the_digest_of_its_files_by_name(tmp_path):
    def told(given):
        return record_provenance({"photos": given}, {})["inputs"]["photos"]

    for name in ("b.png", "a.png", ".hidden"):
        (tmp_path / name).write_text(name)
    assert told(tmp_path) == digest_files(tmp_path / "a.png", tmp_path / "b.png")
    assert told([tmp_path / "b.png", tmp_path]) == digest_files(*(tmp_path / f"{n}.png" for n in "bab"))


def test_results_come_in_the_order_of_the_items_and_an_error_where_its_result_is_taken():
    for threads in (1, 2, 5):
        results = map_ahead(lambda item: 6 // item, [1, 3, 2, 0], threads)
        assert [next(results) for _ in range(3)] == [6, 2, 3]
        with pytest.raises(ZeroDivisionError):
            next(results)


def test_the_next_items_are_worked_on_while_one_is_taken_but_no_more_than_there_are_threads():
    both = threading.Barrier(2, timeout=10)  # broken unless two threads meet here
    assert list(map_ahead(lambda item: both.wait() >= 0, range(4), 2)) == [True] * 4
    begun = []
    for taken, _ in enumerate(map_ahead(begun.append, range(20), 3), start=1):
        assert len(begun) <= taken + 3


def test_a_table_has_five_digits_and_empty_fields_and_one_without_rows_is_an_empty_file(tmp_path):
    files.write_table(tmp_path / "a.csv", [{"a": 1 / 3, "b": 123456, "c": None, "d": True, "e": "x, y"}, {"a": 2}])
    assert (tmp_path / "a.csv").read_bytes() == b'a,b,c,d,e\n0.33333,123456,,True,"x, y"\n2,,,,\n'
    files.write_table(tmp_path / "a.csv", [])
    assert (tmp_path / "a.csv").read_bytes() == b""
    with pytest.raises(ValueError, match="not in fieldnames: 'b'"):
        files.write_table(tmp_path / "a.csv", [{"a": 1}, {"a": 1, "b": 2}])
