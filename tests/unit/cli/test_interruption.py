"""A run that is told to end: jobs that go on are killed, and Snakemake tidies up after them."""

import signal
import subprocess
import sys

import pytest

from dav_gswt.cli import interruption

JOB = "import signal, time; signal.signal(signal.SIGINT, {handler}); print('works', flush=True); time.sleep(600)"
SNAKEMAKE = """
import subprocess, sys, time
job = subprocess.Popen([sys.executable, "-c", sys.argv[2]])
try:
    job.wait()
except KeyboardInterrupt:
    job.wait()
print("tidied", flush=True)
{after}
"""


def start(handler: str, after: str = "") -> subprocess.Popen:
    """A process that looks like Snakemake, with a job."""
    command = [sys.executable, "-c", SNAKEMAKE.format(after=after), "snakemake", JOB.format(handler=handler)]
    job = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
    assert job.stdout.readline() == "works\n"
    return job


@pytest.mark.parametrize("handler", ["signal.default_int_handler", "signal.SIG_IGN"])
def test_snakemake_tidies_up_after_jobs_that_end_and_after_those_that_are_killed(monkeypatch, handler):
    monkeypatch.setattr(interruption, "GRACE", 600.0 if "default" in handler else 1.0)
    job = start(handler)
    interruption.end_run(job, signal.SIGTERM)
    assert job.communicate()[0] == "tidied\n" and job.returncode == 0


def test_what_does_not_end_is_killed(monkeypatch):
    monkeypatch.setattr(interruption, "GRACE", 0.3)
    job = start("signal.SIG_IGN", "time.sleep(600)")
    interruption.end_run(job, signal.SIGTERM)
    assert job.wait() == -signal.SIGKILL


def test_a_signal_before_the_run_ends_it_once_it_runs():
    with interruption.receive_signals() as received:
        signal.raise_signal(signal.SIGTERM)
        job = start("signal.default_int_handler")
        received.watch(job)
        assert job.communicate()[0] == "tidied\n" and received.signals == [signal.SIGTERM]
    assert signal.getsignal(signal.SIGTERM) == signal.SIG_DFL
