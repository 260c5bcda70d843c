"""The short log of `make run`: a plugin of Snakemake that prints its events in a line each."""

import logging
import sys
from types import SimpleNamespace

import pytest
from snakemake_interface_logger_plugins.common import LogEvent


@pytest.fixture
def handler(root, monkeypatch):
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


def test_a_rule_that_only_names_targets_is_no_job(handler):
    assert handler.describe(record(LogEvent.JOB_INFO, rule_name="all", log=[])) is None


def test_a_failed_job_names_its_log(handler):
    failed = record(LogEvent.JOB_ERROR, rule_name="fit_coarse", log=["results/logs/a.log"])
    assert handler.describe(failed) == "fit_coarse is not finished; its log: results/logs/a.log"


def test_the_command_of_a_failed_job_is_left_out(handler):
    error = record(LogEvent.ERROR, "Command 'x' returned non-zero exit status 1.", exception="RuleException")
    assert handler.describe(error) is None


def test_a_job_that_the_system_killed_is_explained(handler):
    error = record(LogEvent.ERROR, "Command 'x' died with <Signals.SIGKILL: 9>.", exception="RuleException")
    assert "SIGKILL" in handler.describe(error) and "memory" in handler.describe(error)


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
