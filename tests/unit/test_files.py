"""Files and folders that are whole or not at all, tables, threads in order, and logs."""

import logging
import subprocess
import sys
from pathlib import Path

import pytest

from dav_gswt import files, logs
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


def test_a_table_has_five_digits_and_empty_fields_and_one_without_rows_is_an_empty_file(tmp_path):
    files.write_table(tmp_path / "a.csv", [{"a": 1 / 3, "b": 123456, "c": None, "d": True, "e": "x, y"}, {"a": 2}])
    assert (tmp_path / "a.csv").read_bytes() == b'a,b,c,d,e\n0.33333,123456,,True,"x, y"\n2,,,,\n'
    files.write_table(tmp_path / "a.csv", [])
    assert (tmp_path / "a.csv").read_bytes() == b""
    with pytest.raises(ValueError, match="not in fieldnames: 'b'"):
        files.write_table(tmp_path / "a.csv", [{"a": 1}, {"a": 1, "b": 2}])


FULL = OSError(28, "No space left on device", "results/field.ply")
FREE_SPACE = "results/field.ply: No space left on device; free some space, then run the same again"


@pytest.mark.parametrize(
    "error, code, said, traced",
    [
        (InputError("photo.jpg: cut short; copy it again"), 1, "photo.jpg: cut short; copy it again", False),
        (FULL, 1, FREE_SPACE, True),
        (KeyboardInterrupt(), 130, "stopped on request", False),
        (MemoryError(), 1, "out of memory", True),
        (ZeroDivisionError(), None, "failed", True),
    ],
)
def test_a_job_ends_with_a_message_and_only_faults_leave_a_traceback(tmp_path, capfd, error, code, said, traced):
    with pytest.raises(SystemExit if code else ZeroDivisionError) as ended, logs.logging_to(tmp_path / "a.log"):
        raise error
    assert getattr(ended.value, "code", None) == code
    text, shown = (tmp_path / "a.log").read_text(), capfd.readouterr().err
    assert said in text and said in shown
    assert ("Traceback" in text) == traced and "Traceback" not in shown


def test_the_last_words_of_a_library_that_aborts_are_in_the_log(tmp_path):
    """It writes past Python, and the process ends at once."""
    code = (
        "import os, logging\nfrom dav_gswt import logs\n"
        "with logs.logging_to('a.log'):\n"
        "    logging.warning('at work')\n    os.write(2, b'database is locked\\n')\n    os.abort()"
    )
    done = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True, check=False)
    text = (tmp_path / "a.log").read_text()
    assert done.returncode == -6 and "at work" in text and "database is locked" in text
    assert "at work" in done.stderr and "locked" not in done.stderr


def test_the_terminal_has_warnings_and_progress_and_the_log_has_all(tmp_path, capfd):
    with logs.logging_to(tmp_path / "a.log"):
        logging.info("a detail")
        logging.warning("a warning")
        list(logs.progress(range(3), "count", every=0.0))
    text, shown = (tmp_path / "a.log").read_text(), capfd.readouterr().err
    assert all(words in text for words in ("a detail", "a warning", "count: 3/3"))
    assert "a detail" not in shown and "a warning" in shown and "count: 3/3" in shown


def test_a_log_on_a_full_disk_leaves_the_terminal_its_messages(capfd):
    with logs.logging_to("/dev/full"):
        logging.warning("a message")
    assert capfd.readouterr().err == "  a message\n"
    with pytest.raises(SystemExit) as ended, logs.logging_to("/none/a.log"):
        pass
    assert ended.value.code == 1 and capfd.readouterr().err == "  /none/a.log: No such file or directory\n"
