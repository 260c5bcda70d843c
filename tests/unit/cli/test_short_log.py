"""The short log of `make run`: a plugin of Snakemake that prints its events in a line each."""

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


def test_the_plan_and_each_job_are_a_line(handler, monkeypatch):
    assert [handler.describe(each) for each in (PLAN, JOB)] == ["1 jobs to do", "[1 of 1] fit_coarse"]
    assert handler.describe(record(LogEvent.JOB_INFO, rule_name="all", log=[])) is None
    failed = record(LogEvent.JOB_ERROR, rule_name="fit_coarse", log=["results/logs/a.log"])
    assert handler.describe(failed) == "fit_coarse is not finished; its log: results/logs/a.log"
    monkeypatch.setenv("DAV_GSWT_PLAN", "1")
    plan = record(LogEvent.RUN_INFO, stats={"fit_coarse": 1, "all": 1, "total": 2})
    assert handler.describe(plan) == '1 jobs to do\nplan: {"fit_coarse": 1, "all": 1}'


NO_SPACE = "[Errno 28] No space left on device"
SPACE = "  No space left on device; free some space, then run the same again"
FAULT = "Traceback (most recent call last):\n\nKeyError: 'a'"


@pytest.mark.parametrize(
    "kind, message, said",
    [
        pytest.param("RuleException", f"in photos.smk:\n{NO_SPACE}\n  File", SPACE, id="a job that is not started"),
        pytest.param("RuleException", "[Errno 30] Read-only file system", "  Read-only file system", id="read-only"),
        pytest.param("RuleException", "Command 'x' returned non-zero exit status 1.", None, id="a failed job"),
        pytest.param("RuleException", "CalledProcessError: [Errno 28] of a job", None, id="a job's own error"),
        pytest.param("OSError", f"Traceback (most recent\n\n{NO_SPACE}", SPACE, id="its own files"),
        pytest.param("WorkflowError", f"Error recording metadata ({NO_SPACE}).", SPACE, id="its records"),
        pytest.param("WorkflowError", "in x.smk\n  config: tau: bad\nWildcards:", "config: tau: bad", id="the config"),
        pytest.param("KeyError", FAULT, FAULT, id="a fault of Snakemake"),
    ],
)
def test_of_an_error_what_helps_is_left(handler, kind, message, said):
    assert handler.describe(record(LogEvent.ERROR, message, exception=kind)) == said


def test_plain_messages_are_shown_from_warnings_on_but_for_that_a_job_failed(handler):
    assert handler.describe(record(None, "a message", logging.INFO)) is None
    assert handler.describe(record(None, "a message", logging.WARNING)) == "a message"
    assert handler.describe(record(None, "Exiting because a job execution failed.", logging.ERROR)) is None


def kill(handler, ending: str, log) -> str:
    """What is printed of a job that ended so."""
    assert handler.describe(record(LogEvent.ERROR, f"Command 'x' {ending}.", exception="RuleException")) is None
    return handler.describe(record(LogEvent.JOB_ERROR, rule_name="register_photos", log=[str(log)]))


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


@pytest.mark.parametrize(
    "name, number, said",
    [
        pytest.param("SIGKILL", 9, "was there too little memory?", id="the system's"),
        pytest.param("SIGTERM", 15, "was stopped (SIGTERM)", id="on request"),
        pytest.param("SIGSEGV", 11, "SIGSEGV; its log names no cause", id="without a log"),
        pytest.param("SIGSEGV", 11, "limited to 1.2 GB here (ulimit -v)", id="a limit of memory"),
    ],
)
def test_a_killed_job_is_explained(handler, tmp_path, monkeypatch, name, number, said):
    monkeypatch.setattr("resource.getrlimit", lambda of: (1_200_000_000, -1))
    told = kill(handler, f"died with <Signals.{name}: {number}>", tmp_path / "none.log")
    assert said in told and "none.log" in told
