import logging
import os
import subprocess
import sys

import pytest

from dav_gswt import logs
from dav_gswt.errors import InputError


def test_bad_input_ends_with_its_message_and_no_traceback(tmp_path, capsys):
    with pytest.raises(SystemExit) as ended, logs.logging_to(tmp_path / "a.log"):
        raise InputError("photo.jpg: cut short; copy it again")
    assert ended.value.code == 1
    assert "photo.jpg: cut short" in capsys.readouterr().err
    text = (tmp_path / "a.log").read_text()
    assert "photo.jpg: cut short" in text and "Traceback" not in text


def test_a_fault_leaves_its_traceback_in_the_log(tmp_path, capsys):
    with pytest.raises(ZeroDivisionError), logs.logging_to(tmp_path / "a.log"):
        1 / 0  # noqa: B018
    assert "ZeroDivisionError" in (tmp_path / "a.log").read_text()
    assert "Traceback" not in capsys.readouterr().err


def test_a_full_disk_names_the_file_and_what_to_do(tmp_path, capsys):
    with pytest.raises(SystemExit) as ended, logs.logging_to(tmp_path / "a.log"):
        raise OSError(28, "No space left on device", "results/field.ply")
    said = "results/field.ply: No space left on device; free some space, then run the same again"
    assert ended.value.code == 1 and capsys.readouterr().err.strip() == said
    text = (tmp_path / "a.log").read_text()
    assert said in text and "Traceback" in text


def test_ctrl_c_ends_a_job_without_a_traceback(tmp_path, capsys):
    with pytest.raises(SystemExit) as ended, logs.logging_to(tmp_path / "a.log"):
        raise KeyboardInterrupt
    assert ended.value.code == 130 and "Traceback" not in capsys.readouterr().err
    assert "Traceback" not in (tmp_path / "a.log").read_text()


def test_the_last_words_of_a_library_that_aborts_are_in_the_log(tmp_path):
    """It writes past Python, and the process ends at once."""
    code = (
        "import os, logging\nfrom dav_gswt import logs\n"
        "with logs.logging_to('a.log'):\n"
        "    logging.info('at work')\n    os.write(2, b'database is locked\\n')\n    os.abort()"
    )
    done = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True, check=False)
    text = (tmp_path / "a.log").read_text()
    assert done.returncode == -6 and "at work" in text and "database is locked" in text
    assert "at work" in done.stderr and "locked" not in done.stderr


def test_stderr_is_as_before_when_a_job_is_over(tmp_path, capfd):
    with logs.logging_to(tmp_path / "a.log"):
        os.write(2, b"inside")
    os.write(2, b"outside")
    assert capfd.readouterr().err == "outside"
    assert (tmp_path / "a.log").read_text() == "inside"


def test_progress_tells_how_far_and_how_long(tmp_path, caplog):
    caplog.set_level(logging.INFO)
    assert list(logs.progress(range(3), "count", every=0.0)) == [0, 1, 2]
    assert "count: 3/3" in caplog.text and "left" in caplog.text


def test_a_loop_that_ends_at_once_says_nothing(caplog):
    caplog.set_level(logging.INFO)
    assert list(logs.progress(range(3), "count")) == [0, 1, 2]
    assert not caplog.text


def test_a_log_that_cannot_be_made_is_a_message_without_a_traceback(tmp_path, capsys):
    with pytest.raises(SystemExit) as ended, logs.logging_to(tmp_path / "none/a.log"):
        pass
    assert ended.value.code == 1 and capsys.readouterr().err == f"  {tmp_path}/none/a.log: No such file or directory\n"


def test_a_log_on_a_full_disk_leaves_the_terminal_its_messages(capsys):
    with logs.logging_to("/dev/full"):
        logging.info("a message")
    assert capsys.readouterr().err == "  a message\n"
