"""A short log for `make run`: which job of how many begins, and why one failed (`snakemake --logger davgswt`).

Snakemake's own events are printed in a line each; warnings and errors go through as they are.
"""

import logging
import re
import sys

from snakemake_interface_logger_plugins.base import LogHandlerBase
from snakemake_interface_logger_plugins.common import LogEvent

KILLED = re.compile(r"died with <Signals\.(SIG\w+)")
FAILED_JOB = ("RuleException", "CalledProcessError")  # of a job whose log tells more
ENDINGS = ("Exiting because a job execution failed", "At least one job did not complete")  # said by the caller


class LogHandler(LogHandlerBase):
    """Prints a line for the plan, each job's begin, each failed job and each error."""

    def __post_init__(self) -> None:
        self.jobs = 0  # to do, without the rule that only names the targets
        self.begun = 0

    def emit(self, record: logging.LogRecord) -> None:
        text = self.describe(record)
        if text:
            print(text, file=sys.stdout, flush=True)

    def describe(self, record: logging.LogRecord) -> str | None:
        """The line for a record; None for none."""
        event = getattr(record, "event", None)
        if any(ending in record.getMessage() for ending in ENDINGS):
            return None
        if event == LogEvent.RUN_INFO:
            self.jobs = record.__dict__["stats"]["total"] - 1
            return f"{self.jobs} jobs to do"
        if event == LogEvent.JOB_INFO:
            return self._describe_job(record.__dict__)
        if event == LogEvent.JOB_ERROR:
            logs = ", ".join(map(str, record.__dict__.get("log") or []))
            return f"{record.__dict__['rule_name']} is not finished; its log: {logs}"
        if event == LogEvent.ERROR:
            return self._describe_error(record)
        return record.getMessage() if event is None and record.levelno >= logging.WARNING else None

    def _describe_job(self, job: dict) -> str | None:
        if not job["log"]:  # a rule that only names targets
            return None
        self.begun += 1
        return f"[{self.begun} of {self.jobs}] {job['rule_name']}"

    def _describe_error(self, record: logging.LogRecord) -> str | None:
        message = record.getMessage()
        if killed := KILLED.search(message):
            return f"  the job was killed ({killed[1]}); is there too little memory? A smaller preset needs less"
        own = [line.strip() for line in message.splitlines() if line.strip().startswith("config:")]
        if own:  # of an error in the config, Snakemake's frame of files and wildcards is left out
            return "\n".join(own)
        return None if record.__dict__.get("exception") in FAILED_JOB else message

    @property
    def writes_to_stream(self) -> bool:
        return True

    @property
    def writes_to_file(self) -> bool:
        return False

    @property
    def has_filter(self) -> bool:
        return True

    @property
    def has_formatter(self) -> bool:
        return True

    @property
    def needs_rulegraph(self) -> bool:
        return False
