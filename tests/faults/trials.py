"""What is done to runs. A series is one run that is struck again and again, then let go on to its end."""

import os
import random
import resource
import subprocess
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from copy import copy
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path

import psutil
from faults.experiment import START, Ended, Experiment, Reference

FULL, KILLED = "free some space", "was killed by SIGKILL: was there too little memory?"
LATENCY, TOO_LATE = 3, 8  # seconds that Snakemake waits for files; seconds after which they appear


@dataclass(frozen=True)
class Strike:
    """A fault that struck a run. stage: the rule that ran; complaints: what went wrong, a line each."""

    fault: str
    stage: str
    complaints: list[str] = field(default_factory=list)


@dataclass(frozen=True)
class Trial:
    """What a series needs."""

    fault: str
    folder: Path
    wanted: Reference
    rng: random.Random
    cores: int

    def begin(self) -> Experiment:
        return Experiment(self.folder / "run", self.cores)

    def wait_within(self, run: Experiment, job: subprocess.Popen, stage: str, part: float = 1.0) -> None:
        """Wait for a random moment of a stage, in its first part."""
        run.wait_for_stage(job, self.list_from(stage))
        with suppress(subprocess.TimeoutExpired):
            job.wait(part * self.rng.uniform(0, self.wanted.seconds[stage]))

    def list_from(self, stage: str) -> set[str]:
        """A stage and all that come after it."""
        return set(self.wanted.stages[self.wanted.stages.index(stage) :])

    def judge(self, ended: Ended, run: Experiment, words: str) -> Strike:
        """A run that failed: it must say so in its words, and leave no output that is half made."""
        complaints = run.find_differences(self.wanted, ended.stage, whole=False)
        if "Traceback" in ended.said or words not in ended.said:
            complaints.append(f"{ended.stage}: {ended.describe()}")
        return Strike(self.fault, ended.stage, complaints)

    def judge_refused(self, ended: Ended, stage: str) -> Strike:
        """A run beside another one."""
        right = ended.status == 1 and "another run works in this folder" in ended.said
        return Strike(self.fault, stage, [] if right else [f"{stage}: {ended.describe()}"])

    def end(self, run: Experiment, strikes: list[Strike]) -> list[Strike]:
        """Let the run go on. If its bytes are wrong, every strike may be the cause, so each is lost."""
        complaints = run.finish(self.wanted, ", ".join(each.stage for each in strikes))
        return [Strike(each.fault, each.stage, each.complaints + complaints) for each in strikes]


def kill_runs(trial: Trial) -> list[Strike]:
    """kill -9 to a run and its jobs, at a random moment of every stage."""
    run, strikes = trial.begin(), []
    for stage in trial.wanted.stages:
        job = run.start()
        trial.wait_within(run, job, stage)
        if job.poll() is None:  # not over before it could be killed
            strikes.append(Strike(trial.fault, run.kill(job).stage))
    return trial.end(run, strikes)


def kill_jobs(trial: Trial) -> list[Strike]:
    """kill -9 to a job alone, in every stage, as the system does when memory runs out."""
    run, strikes = trial.begin(), []
    for rule in trial.wanted.stages[1:]:
        job = run.start()
        trial.wait_within(run, job, rule, 0.5)
        found = (run.find_script(Ended(0, run.out.read_text()).stage) for _ in run.watch(job))
        with suppress(psutil.Error):
            if process := next(filter(None, found), None):
                process.kill()
        if (ended := run.wait(job)).status:
            strikes.append(trial.judge(ended, run, KILLED))
    return trial.end(run, strikes)


def fill_disk(trial: Trial) -> list[Strike]:
    """A file system on which at most 28 KiB are left when a stage begins, in every stage.

    Without root: a limit of the size of files instead.
    """
    if os.geteuid():
        return starve(trial, resource.RLIMIT_FSIZE, [int(30_000 * 1.3**k) for k in range(20)], FULL)
    with mount_memory(trial.folder / "run"):
        run, strikes = trial.begin(), []
        for stage in trial.wanted.stages:
            job = run.start()
            run.wait_for_stage(job, trial.list_from(stage))
            leave_room(run.folder, 4096 * trial.rng.randrange(8))
            if (ended := run.wait(job)).status:
                strikes.append(trial.judge(ended, run, FULL))
            resize_memory(run.folder, 1 << 30)
        return trial.end(run, strikes)


def limit_memory(trial: Trial) -> list[Strike]:
    """A limit of the address space, a bit larger after every failure."""
    return starve(trial, resource.RLIMIT_AS, [int(1e9 * 1.1**k) for k in range(30)], "memory")


def starve(trial: Trial, kind: int, sizes: list[int], words: str) -> list[Strike]:
    """Run under one limit of a resource (`resource.RLIMIT_...`, bytes) after the other until a run ends well."""
    run, strikes = trial.begin(), []
    for size in sizes:
        limit = partial(resource.setrlimit, kind, (size, resource.RLIM_INFINITY))
        if not (ended := run.run(limit)).status:
            break
        strikes.append(trial.judge(ended, run, words))
    return trial.end(run, strikes)


def forbid_writing(trial: Trial) -> list[Strike]:
    """results/ becomes read-only in every stage, and writable again."""
    run, strikes = trial.begin(), []
    (run.folder / "results").mkdir()
    for rule in trial.wanted.stages[1:]:
        job = run.start()
        trial.wait_within(run, job, rule, 0.5)
        with mount_read_only(run.folder / "results"):
            ended = run.wait(job)
        if ended.status:
            strikes.append(trial.judge(ended, run, "Read-only file system"))
    return trial.end(run, strikes)


def set_clock(trial: Trial) -> list[Strike]:
    """Kill a run in some stages, and date its files later or earlier, as if the clock had been set since.

    Files of an hour or a day ahead are there after a clock that was set back.
    """
    run, strikes = trial.begin(), []
    for rule, seconds in zip(trial.wanted.stages[3::4], (3600, -3600, 86400, -86400), strict=False):
        job = run.start()
        run.wait_for_stage(job, trial.list_from(rule))
        strikes.append(Strike(trial.fault, run.kill(job).stage))
        for path in (run.folder / "results").rglob("*"):
            os.utime(path, (time.time(), path.lstat().st_mtime + seconds), follow_symlinks=False)
    strikes = trial.end(run, strikes)
    again = run.run()
    complaints = [] if "Up to date" in again.said else [again.describe()]
    return [Strike(each.fault, each.stage, each.complaints + complaints) for each in strikes]


def run_twice(trial: Trial) -> list[Strike]:
    """Two runs at the same moment, then another one in every stage: one works, the others are refused."""
    runs = [trial.begin()]
    runs.append(copy(runs[0]))
    runs[1].out = runs[0].out.with_name("second.txt")
    jobs = [run.start() for run in runs]
    for _ in runs[0].watch(jobs[0]):
        if jobs[1].poll() is not None:
            break
    loser = int(jobs[0].poll() is None)
    first, second, job = runs[1 - loser], runs[loser], jobs[1 - loser]
    strikes = [trial.judge_refused(second.wait(jobs[loser]), START)]
    for rule in trial.wanted.stages[1:]:
        first.wait_for_stage(job, trial.list_from(rule))
        if job.poll() is None:
            strikes.append(trial.judge_refused(second.run(), Ended(0, first.out.read_text()).stage))
    first.wait(job)
    return trial.end(first, strikes)


def delay_files(trial: Trial) -> list[Strike]:
    """Outputs of every job appear late, but sooner than Snakemake waits: as long as the profile says, or less."""
    run = trial.begin()
    ended = [run.run_on_cluster([], slow_files(40), ["results/desert/seed0/views.json"])]
    ended.append(run.run_on_cluster(["--latency-wait", str(TOO_LATE)], slow_files(LATENCY)))
    complaints = [each.describe() for each in ended if each.status] + run.find_differences(trial.wanted, "late")
    return [Strike(trial.fault, rule, complaints) for rule in trial.wanted.stages[1:]]


def delay_files_too_long(trial: Trial) -> list[Strike]:
    """Outputs of each rule in turn appear later than Snakemake waits: the run fails, and goes on later."""
    run, strikes = trial.begin(), []
    for rule in trial.wanted.stages[1:]:
        options = ["--latency-wait", str(LATENCY), "--retries", "0"]
        ended = run.run_on_cluster(options, slow_files(TOO_LATE, rule))
        said = Ended(ended.status, ended.said + f"\n[1 of 1] {rule}")  # the long log names rules in another way
        strikes.append(trial.judge(said, run, "--latency-wait"))
        time.sleep(TOO_LATE - LATENCY + 1)
    return trial.end(run, strikes)


def slow_files(seconds: float, rules: str = "") -> dict[str, str]:
    """The environment in which outputs of jobs appear late."""
    return {
        "PYTHONPATH": str(Path(__file__).parent / "late_files"),
        "LATE_SECONDS": str(seconds),
        "LATE_RULES": rules,
    }


@contextmanager
def mount_memory(folder: Path) -> Iterator[None]:
    """A file system in memory at a folder."""
    folder.mkdir(parents=True)
    subprocess.run(["mount", "-t", "tmpfs", "-o", "size=1g", "tmpfs", folder], check=True)
    try:
        yield
    finally:
        subprocess.run(["umount", "--lazy", folder], check=True)


def resize_memory(folder: Path, size: int) -> bool:
    """Whether it could be done: it cannot become smaller than what it holds."""
    done = subprocess.run(["mount", "-o", f"remount,size={size}", folder], capture_output=True, check=False)
    return not done.returncode


def leave_room(folder: Path, room: int) -> None:
    """Shrink a file system in memory to what it holds and so many bytes more, while others write to it."""
    done = False
    while not done:
        found = os.statvfs(folder)
        done = resize_memory(folder, (found.f_blocks - found.f_bfree) * found.f_frsize + room)


@contextmanager
def mount_read_only(folder: Path) -> Iterator[None]:
    """A folder cannot be written to meanwhile. It needs root."""
    subprocess.run(["mount", "--bind", folder, folder], check=True)
    try:
        subprocess.run(["mount", "-o", "remount,ro,bind", folder], check=True)
        yield
    finally:
        subprocess.run(["umount", "--lazy", folder], check=True)
