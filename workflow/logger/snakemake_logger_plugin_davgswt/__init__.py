"""A short log for `make run`: which job of how many runs, how long it took, and why one failed.

`snakemake --logger davgswt`: Snakemake's own events are printed in a line each; warnings and errors go through.
"""

import errno
import logging
import os
import re
import resource
import signal
import sys
import time
from collections import deque
from pathlib import Path

from snakemake_interface_logger_plugins.base import LogHandlerBase
from snakemake_interface_logger_plugins.common import LogEvent

# How a job ended that a signal killed: as its parent saw it, or by the exit status of the shell between them.
KILLED = re.compile(r"died with <Signals\.(SIG\w+)|returned non-zero exit status (1[2-9]\d)\b")
ON_REQUEST = ("SIGINT", "SIGTERM")  # nothing is wrong with the job then
# Lines of a log that say why a job ended: of Python's logging, of COLMAP (F or E and the date), of C++ and of Python.
CAUSE = re.compile(
    r"\S+ \S+ (ERROR|CRITICAL) |[EF]\d{8} |terminate called|  what\(\):|Fatal Python error|\w*(Error|Exception): "
)
CAUSE_LINES = 3  # of them, the last ones
FAILED_JOB = ("RuleException", "CalledProcessError")
SYSTEM_ERROR = re.compile(r"^(?:\w+: |Error recording metadata.*?\()?\[Errno (\d+)\] ([^)\n]+)", re.M)
OWN_FILES = ("Traceback (most", "Error recording metadata")  # are in what Snakemake says of its own files, at the end
NO_SPACE = (errno.ENOSPC, errno.EFBIG, errno.EDQUOT)
RUNNING = " ..."  # ends the line of a job that begins; the line of one that has ended has its time
STAGES = {  # rules in words
    "choose_frames": "choose frames of the video",
    "register_photos": "place the photos",
    "render_photos": "render the photos",
    "import_field": "read the splat",
    "split_views": "set test photos aside",
    "report_photos": "report on the photos",
    "fit_coarse": "fit the ground",
    "copy_coarse_field": "keep the first fit",
    "copy_chosen_photos": "keep the chosen photos",
    "inpaint_field": "paint ground that no photo saw",
    "prepare_external_field": "prepare the splat",
    "request_views": "ask for photos",
    "evaluate_coarse": "judge by test photos",
    "score_coarse": "score poses",
    "select_poses": "choose photos",
    "capture_views": "take photos",
    "update_field": "fit the ground with more photos",
    "fit_windows": "fit the ground that tiles are cut from",
    "fit_chosen_photos": "fit the ground to the chosen photos",
    "evaluate_round": "judge by test photos",
    "score_round": "score poses",
    "find_materials": "tell materials and objects apart",
    "make_levels": "make levels of detail",
    "cut_tiles": "cut tiles",
    "bundle_tiles": "pack the tiles",
    "make_page": "write the page",
    "render_terrain": "render stills",
    "make_contact_sheet": "lay stills side by side",
    "export_model": "write the photos' cameras for other programs",
    "export_terrain": "export a finite terrain",
    "export_ground": "export the ground",
    "export_tiles": "export the tile set",
    "measure_orders": "measure draw orders",
    "gather_sweep": "gather the runs of a sweep",
    "tabulate_timing": "tabulate times",
}
ENDINGS = ("Exiting because a job execution failed", "At least one job did not complete")  # said by the caller


class LogHandler(LogHandlerBase):
    """Prints a line for the plan, each job's begin and end, each failed job and each error."""

    def __post_init__(self) -> None:
        self.start = Path.cwd()  # of whoever called; Snakemake goes on to the folder of the results
        self.running: dict[int, tuple[str, float]] = {}  # stages of jobs and when they began, by Snakemake's number
        self.jobs = 0  # to do, without the rule that only names the targets
        self.ended = 0  # jobs end in another order than they begin in, so lines are numbered at the end
        self.signals: deque[str] = deque()  # of killed jobs whose name and log are still to come
        logging.raiseExceptions = False  # Snakemake's own log file on a full disk is not worth a traceback a line

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
            return self._describe_plan(dict(record.__dict__["stats"]))
        if event == LogEvent.JOB_INFO:
            return self._describe_job(record.__dict__)
        if event == LogEvent.JOB_FINISHED:
            return self._describe_end(record.__dict__)
        if event == LogEvent.JOB_ERROR:
            return self._describe_failed_job(record.__dict__)
        if event == LogEvent.ERROR:
            return self._describe_error(record)
        return record.getMessage() if event is None and record.levelno >= logging.WARNING else None

    def _describe_plan(self, jobs: dict[str, int]) -> str:
        self.jobs = jobs["total"] - 1
        return f"{self.jobs} job{'s' * (self.jobs != 1)} to do"

    def _describe_job(self, job: dict) -> str | None:
        if not job["log"]:  # a rule that only names targets
            return None
        stage = STAGES.get(job["rule_name"], job["rule_name"])
        self.running[job["jobid"]] = stage, time.monotonic()
        return f"[{self.ended + 1} of {self.jobs}] {stage}{RUNNING}"

    def _describe_end(self, job: dict) -> str | None:
        stage, begun = self.running.pop(job["job_id"], (None, 0.0))
        self.ended += stage is not None
        return stage and f"[{self.ended} of {self.jobs}] {stage}: {time.monotonic() - begun:.0f} s"

    def _describe_failed_job(self, job: dict) -> str:
        logs = [Path(path) for path in job.get("log") or []]
        shown = ", ".join(os.path.relpath(path.absolute(), self.start) for path in logs)
        text = f"{job['rule_name']} is not finished; its log: {shown}"
        return "\n".join([*explain_signal(self.signals.popleft(), logs), text]) if self.signals else text

    def _describe_error(self, record: logging.LogRecord) -> str | None:
        message = record.getMessage()
        if name := find_signal(message):
            self.signals.append(name)
            return None
        own = [line.strip() for line in message.splitlines() if line.strip().startswith("config:")]
        if own:  # of an error in the config, Snakemake's frame of files and wildcards is left out
            return "\n".join(own)
        if record.__dict__.get("exception") in FAILED_JOB:
            return describe_system_error(message)
        own = any(words in message for words in OWN_FILES)
        return (own and describe_system_error(message.strip().splitlines()[-1])) or message

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


def describe_system_error(message: str) -> str | None:
    """The system's error that kept Snakemake from working; None for that of a job, whose log tells more."""
    found = SYSTEM_ERROR.search(message)
    if "CalledProcessError" in message or not found:
        return None
    return f"  {found[2]}" + ("; free some space, then run the same again" if int(found[1]) in NO_SPACE else "")


def find_signal(message: str) -> str | None:
    """The name of the signal that ended a job, from Snakemake's message; None where none did."""
    killed = KILLED.search(message)
    if not killed:
        return None
    try:
        return killed[1] or signal.Signals(int(killed[2]) - 128).name
    except ValueError:  # an exit status of the program's own
        return None


def explain_signal(name: str, logs: list[Path]) -> list[str]:
    """Lines that say which signal ended a job, and why as far as its log tells."""
    if name in ON_REQUEST:
        return [f"  the job was stopped ({name})"]
    if name == "SIGKILL":  # the only one that the system sends when memory runs out
        return ["  the job was killed by SIGKILL: was there too little memory? A smaller preset needs less"]
    cause = [line for path in logs for line in read_cause(path)]
    return [
        f"  the job was killed by {name}" + (":" if cause else "; its log names no cause"),
        *cause,
        *limit_of_memory(),
    ]


def limit_of_memory() -> list[str]:
    """A line that names the limit of the address space; none where there is no limit."""
    limit, _ = resource.getrlimit(resource.RLIMIT_AS)
    return [] if limit == resource.RLIM_INFINITY else [f"  memory is limited to {limit / 1e9:.1f} GB here (ulimit -v)"]


def read_cause(path: Path) -> list[str]:
    """The last lines of a log that say what went wrong."""
    try:
        lines = path.read_text(encoding="utf-8", errors="replace").splitlines()
    except OSError:
        return []
    return [f"    {line.strip()}" for line in lines if CAUSE.match(line)][-CAUSE_LINES:]
