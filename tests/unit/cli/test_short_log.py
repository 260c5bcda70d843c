"""The short log of `make run`: a plugin of Snakemake that prints its events in a line each."""

import errno
import io
import logging
import sys
from types import SimpleNamespace

import pytest
from snakemake_interface_logger_plugins.common import LogEvent


@pytest.fixture
def handler(root, monkeypatch):
    monkeypatch.setattr(logging, "raiseExceptions", logging.raiseExceptions)
    monkeypatch.syspath_prepend(root / "workflow/logger")
    import snakemake_logger_plugin_davgswt as plugin

    yield plugin.LogHandler(SimpleNamespace(), None)
    sys.modules.pop("snakemake_logger_plugin_davgswt")


def record(event: LogEvent | None, message: str = "", level: int = logging.INFO, **fields) -> logging.LogRecord:
    made = logging.LogRecord("snakemake", level, "", 0, message, None, None)
    made.__dict__.update(fields | ({"event": event} if event else {}))
    return made


PLAN = record(LogEvent.RUN_INFO, stats={"fit_coarse": 1, "all": 1, "total": 2})
JOB = record(LogEvent.JOB_INFO, rule_name="fit_coarse", log=["results/logs/a.log"])


def test_the_plan_and_each_job_are_a_line(handler):
    assert [handler.describe(each) for each in (PLAN, JOB)] == ["1 jobs to do", "[1 of 1] fit_coarse"]


def test_the_plan_is_told_to_a_program_that_asks(handler, monkeypatch):
    monkeypatch.setenv("DAV_GSWT_PLAN", "1")
    assert handler.describe(PLAN) == '1 jobs to do\nplan: {"fit_coarse": 1, "all": 1}'


def test_a_rule_that_only_names_targets_is_no_job(handler):
    assert handler.describe(record(LogEvent.JOB_INFO, rule_name="all", log=[])) is None


def test_a_failed_job_names_its_log(handler):
    failed = record(LogEvent.JOB_ERROR, rule_name="fit_coarse", log=["results/logs/a.log"])
    assert handler.describe(failed) == "fit_coarse is not finished; its log: results/logs/a.log"


@pytest.mark.parametrize(
    "number, text, said",
    [
        (
            errno.ENOSPC,
            "No space left on device",
            "  No space left on device; free some space, then run the same again",
        ),
        (errno.EROFS, "Read-only file system", "  Read-only file system"),
    ],
)
def test_a_job_that_could_not_be_started_says_why(handler, number, text, said):
    message = f'OSError in file "/a/rules/photos.smk", line 55:\n[Errno {number}] {text}\n  File "/b/tempfile.py"'
    assert handler.describe(record(LogEvent.ERROR, message, exception="RuleException")) == said


@pytest.mark.parametrize(
    "message",
    [
        'Traceback (most recent call last):\n\n  File "/a.py", line 7\n\nOSError: [Errno 28] No space left on device',
        "OSError: [Errno 28] No space left on device\n\n\nDuring handling of the above exception, another exception "
        "occurred:\n\nTraceback (most recent call last):\n\nOSError: [Errno 28] No space left on device\n",
        "WorkflowError:\nError recording metadata for finished job ([Errno 28] No space left on device). "
        "Please ensure write permissions for the directory /a/.snakemake",
    ],
)
def test_that_snakemake_cannot_write_its_own_files_is_a_line(handler, message):
    said = handler.describe(record(LogEvent.ERROR, message, exception="OSError"))
    assert said == "  No space left on device; free some space, then run the same again"


def test_a_fault_of_snakemake_goes_through_with_its_traceback(handler):
    message = "Traceback (most recent call last):\n\nKeyError: 'a'"
    assert handler.describe(record(LogEvent.ERROR, message, exception="KeyError")) == message


class FullDisk(io.StringIO):
    def write(self, text: str) -> int:
        raise OSError(errno.ENOSPC, text)


def test_a_log_file_that_cannot_grow_prints_nothing(handler, capsys):
    logging.StreamHandler(FullDisk()).emit(record(None, "a message"))
    assert capsys.readouterr().err == ""


def test_the_command_of_a_failed_job_is_left_out(handler):
    error = record(LogEvent.ERROR, "Command 'x' returned non-zero exit status 1.", exception="RuleException")
    assert handler.describe(error) is None


def kill(handler, ending: str, log) -> str:
    """What is printed of a job that ended so."""
    assert handler.describe(record(LogEvent.ERROR, f"Command 'x' {ending}.", exception="RuleException")) is None
    return handler.describe(record(LogEvent.JOB_ERROR, rule_name="register_photos", log=[str(log)]))


def test_a_job_that_the_system_killed_is_explained(handler, tmp_path):
    said = kill(handler, "died with <Signals.SIGKILL: 9>", tmp_path / "a.log")
    assert "SIGKILL" in said and "too little memory" in said and "a.log" in said


@pytest.mark.parametrize("ending", ["died with <Signals.SIGABRT: 6>", "returned non-zero exit status 134"])
def test_another_signal_is_named_with_the_last_errors_of_the_log(handler, tmp_path, ending):
    (tmp_path / "a.log").write_text(
        "2026-11-24 12:00:00,001 INFO find features: 7/28\n"
        "F20261124 12:00:01.000000 7 database_sqlite.cc:57] SQLite error: database is locked\n"
        "*** Check failure stack trace: ***\n"
    )
    said = kill(handler, ending, tmp_path / "a.log")
    assert "SIGABRT" in said and "database is locked" in said
    assert "memory" not in said and "find features" not in said


def test_a_limit_of_memory_is_named_beside_a_signal(handler, tmp_path, monkeypatch):
    monkeypatch.setattr("resource.getrlimit", lambda of: (1_200_000_000, -1))
    assert "limited to 1.2 GB here (ulimit -v)" in kill(handler, "died with <Signals.SIGABRT: 6>", tmp_path / "a.log")


def test_a_killed_job_without_a_log_is_named_all_the_same(handler, tmp_path):
    assert "SIGSEGV; its log names no cause" in kill(handler, "died with <Signals.SIGSEGV: 11>", tmp_path / "none.log")


def test_a_job_that_was_told_to_stop_has_no_fault(handler, tmp_path):
    assert "was stopped (SIGTERM)" in kill(handler, "died with <Signals.SIGTERM: 15>", tmp_path / "a.log")


def test_of_an_error_in_the_config_its_own_line_is_left(handler):
    message = "WorkflowError in file x.smk, line 8:\n  config: tau: too large\nWildcards:\n  scene=a"
    assert handler.describe(record(LogEvent.ERROR, message, exception="WorkflowError")) == "config: tau: too large"


def test_another_error_goes_through_as_it_is(handler):
    assert handler.describe(record(LogEvent.ERROR, "no rule", exception="MissingRuleException")) == "no rule"


@pytest.mark.parametrize("level, shown", [(logging.INFO, None), (logging.WARNING, "a message")])
def test_plain_messages_are_shown_from_warnings_on(handler, level, shown):
    assert handler.describe(record(None, "a message", level)) == shown


def test_that_a_job_failed_is_not_said_twice(handler):
    message = "Exiting because a job execution failed. Look below for error messages"
    assert handler.describe(record(None, message, logging.ERROR)) is None
