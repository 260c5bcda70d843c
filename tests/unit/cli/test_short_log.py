"""The short log of `make run`: a plugin of Snakemake that prints its events in a line each."""

import logging
import re
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
JOB = record(LogEvent.JOB_INFO, rule_name="fit_coarse", jobid=3, log=["results/logs/a.log"])
END = record(LogEvent.JOB_FINISHED, job_id=3)


def test_the_plan_and_the_begin_and_the_end_of_each_job_are_a_line(handler):
    lines = ["1 job to do", "[1 of 1] fit the ground ...", "[1 of 1] fit the ground: 0 s"]
    assert [handler.describe(each) for each in (PLAN, JOB, END)] == lines
    assert handler.describe(record(LogEvent.JOB_FINISHED, job_id=4)) is None
    assert handler.describe(record(LogEvent.JOB_INFO, rule_name="all", log=[])) is None
    failed = record(LogEvent.JOB_ERROR, rule_name="fit_coarse", log=["results/logs/a.log"])
    assert handler.describe(failed) == "fit_coarse is not finished; its log: results/logs/a.log"


def test_every_rule_that_makes_something_has_words(handler, root):
    text = "\n".join(path.read_text(encoding="utf-8") for path in (root / "rules").glob("*.smk"))
    rules = {
        name for name, body in re.findall(r"^rule (\w+):\n((?:(?!^rule ).*\n)*)", text, re.M) if "    log:" in body
    }
    words = sys.modules[type(handler).__module__].STAGES
    assert "fit_windows" in rules and not rules - set(words)


NO_SPACE = "[Errno 28] No space left on device"
SPACE = "  No space left on device; free some space, then run the same again"
FAULT = "Traceback (most recent call last):\n\nKeyError: 'a'"


@pytest.mark.parametrize(
    "kind, message, said",
    [
        pytest.param("RuleException", f"in photos.smk:\n{NO_SPACE}\n  File", SPACE, id="a job that is not started"),
        pytest.param("RuleException", "Command 'x' returned non-zero exit status 1.", None, id="a failed job"),
        pytest.param("OSError", f"Traceback (most recent\n\n{NO_SPACE}", SPACE, id="its own files"),
        pytest.param("WorkflowError", "in x.smk\n  config: tau: bad\nWildcards:", "config: tau: bad", id="the config"),
        pytest.param("KeyError", FAULT, FAULT, id="a fault of Snakemake"),
    ],
)
def test_of_an_error_what_helps_is_left(handler, kind, message, said):
    assert handler.describe(record(LogEvent.ERROR, message, exception=kind)) == said
