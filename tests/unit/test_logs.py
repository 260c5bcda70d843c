import logging

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


def test_progress_tells_how_far_and_how_long(tmp_path, caplog):
    caplog.set_level(logging.INFO)
    assert list(logs.progress(range(3), "count", every=0.0)) == [0, 1, 2]
    assert "count: 3/3" in caplog.text and "left" in caplog.text


def test_a_loop_that_ends_at_once_says_nothing(caplog):
    caplog.set_level(logging.INFO)
    assert list(logs.progress(range(3), "count")) == [0, 1, 2]
    assert not caplog.text
