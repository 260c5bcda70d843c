import logging
import os
import subprocess
import sys

import pytest

from dav_gswt import logs
from dav_gswt.errors import InputError

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


def test_stderr_is_as_before_when_a_job_is_over(tmp_path, capfd):
    with logs.logging_to(tmp_path / "a.log"):
        os.write(2, b"inside")
    os.write(2, b"outside")
    assert capfd.readouterr().err == "outside"
    assert (tmp_path / "a.log").read_text() == "inside"


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
