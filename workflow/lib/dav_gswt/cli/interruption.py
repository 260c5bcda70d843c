"""How a run ends on Ctrl-C or SIGTERM: its jobs within seconds, then Snakemake, which removes what is half made."""

import signal
import subprocess
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress

import psutil

GRACE = 5.0  # seconds that a job has to end by itself, and then Snakemake
POLL = 0.1  # seconds


class Interruption:
    """The signals that came, and the run that they end.

    Attributes:
        signals: their numbers, in order.
    """

    def __init__(self) -> None:
        self.signals: list[int] = []
        self._job: subprocess.Popen | None = None

    def watch(self, job: subprocess.Popen) -> None:
        """From now on signals end this run. job: Snakemake."""
        self._job = job
        if self.signals:
            self._end(self.signals[0])

    def receive(self, number: int, _frame: object) -> None:
        """Record a signal; the first one ends the run, without waiting for that."""
        self.signals.append(number)
        if len(self.signals) == 1:
            self._end(number)

    def _end(self, number: int) -> None:
        if self._job:
            threading.Thread(target=end_run, args=(self._job, number), daemon=True).start()


@contextmanager
def receive_signals() -> Iterator[Interruption]:
    """Receive Ctrl-C and SIGTERM while a run works.

    It is entered before Snakemake starts: a shell has the commands that it starts in the background ignore Ctrl-C, and
    Snakemake would inherit that if the signal had no handler here.
    """
    received = Interruption()
    before = {number: signal.signal(number, received.receive) for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield received
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def end_run(job: subprocess.Popen, number: int) -> None:
    """End Snakemake and its jobs.

    A terminal sends Ctrl-C to all of them. SIGTERM comes to this process alone: they are interrupted here in the same
    way. Jobs that go on (in compiled code) are killed after GRACE seconds, and Snakemake tidies up after them; what is
    left after as long again is killed.
    """
    interrupted: set[int] = set()
    begun = time.monotonic()
    if number == signal.SIGTERM:
        job.send_signal(signal.SIGINT)
    while job.poll() is None and (passed := time.monotonic() - begun) < 3 * GRACE:
        for process in _list_children(job.pid):
            if passed > 2 * GRACE or (passed > GRACE and not _is_snakemake(process)):
                _send(process, signal.SIGKILL)
            elif number == signal.SIGTERM and process.pid not in interrupted:
                interrupted.add(process.pid)
                _send(process, signal.SIGINT)
        time.sleep(POLL)
    if job.poll() is None:
        job.kill()


def _list_children(pid: int) -> list[psutil.Process]:
    try:
        return psutil.Process(pid).children(recursive=True)
    except psutil.Error:
        return []


def _is_snakemake(process: psutil.Process) -> bool:
    try:
        return any(word.endswith("snakemake") for word in process.cmdline()[:4])
    except psutil.Error:
        return False


def _send(process: psutil.Process, number: int) -> None:
    with suppress(psutil.Error):  # it has ended
        process.send_signal(number)
