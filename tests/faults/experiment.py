"""A copy of the repository in a folder of its own, in which the smallest experiment runs and is disturbed."""

import os
import re
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import psutil
from fixtures.runs import TINY, USUAL

from dav_gswt.files import digest_files

ROOT = Path(__file__).parents[2]
COPIED = ["Snakefile", "rules", "scripts", "config", "workflow", "profiles"]  # the last is a link
ONE_THREAD = {"DAV_GSWT_THREADS": "1", "OMP_NUM_THREADS": "1"}
PATIENCE = 600.0  # seconds after which a run hangs
POLL = 0.02  # seconds
START = "before the first job"


@dataclass(frozen=True)
class Reference:
    """A run that nothing disturbed. digests: of its files; seconds: from the begin of each stage to the next."""

    digests: dict[str, str]
    seconds: dict[str, float]

    @property
    def stages(self) -> list[str]:
        """In their order: what comes before the first job, and each rule."""
        return list(self.seconds)


@dataclass(frozen=True)
class Ended:
    """A run that has ended, with its exit status and what it printed."""

    status: int
    said: str

    @property
    def stage(self) -> str:
        """The rule that began last."""
        return (list_rules(self.said) or [START])[-1]

    def describe(self) -> str:
        lines = list(filter(None, self.said.splitlines()))
        return f"status {self.status}: {lines[-6:]}"


class Experiment:
    """A copy of the repository. What a run prints is beside the folder, so that a full disk takes no word of it."""

    def __init__(self, folder: Path, cores: int):
        self.folder, self.cores = folder, cores
        self.out = folder.with_suffix(".txt")
        self.temporary = folder / "tmp"
        folder.mkdir(parents=True, exist_ok=True)
        self.temporary.mkdir()
        for name in COPIED:
            source = ROOT / name
            if source.is_dir() and not source.is_symlink():
                shutil.copytree(source, folder / name, ignore=shutil.ignore_patterns("__pycache__"))
            else:
                shutil.copy(source, folder / name, follow_symlinks=False)

    def start(
        self, limit: Callable | None = None, command: list[str] | None = None, more: dict[str, str] | None = None
    ) -> subprocess.Popen:
        """Begin a run in a session of its own. limit: sets one of a resource for the run and all its jobs.

        command: other than that of `make run`; more: environment variables.
        """
        usual = ["dav_gswt.cli.run", "--cores", str(self.cores), "--configfile", TINY]
        with self.out.open("w") as file:
            return subprocess.Popen(
                [sys.executable, "-m", *(command or usual)],
                cwd=self.folder,
                stdout=file,
                stderr=file,
                start_new_session=True,
                env=os.environ | ONE_THREAD | {"TMPDIR": str(self.temporary)} | (more or {}),
                preexec_fn=limit,
            )

    def run(self, limit: Callable | None = None) -> Ended:
        return self.wait(self.start(limit))

    def run_on_cluster(self, options: list[str], more: dict[str, str], targets: list[str] | None = None) -> Ended:
        """Run with the profile for clusters, but here. options: of Snakemake; more: environment variables."""
        command = ["snakemake", "--profile", "workflow/profiles/slurm", "--executor", "local", "--cores", "1"]
        return self.wait(
            self.start(command=[*command, *options, "--configfile", USUAL, TINY, "--", *(targets or [])], more=more)
        )

    def wait(self, job: subprocess.Popen) -> Ended:
        """Wait for the end of a run. One that hangs is killed, with a status below zero."""
        try:
            status = job.wait(PATIENCE)
        except subprocess.TimeoutExpired:
            status = self.kill(job).status
        return Ended(status, self.out.read_text())

    def kill(self, job: subprocess.Popen) -> Ended:
        """Kill a run with all its jobs."""
        os.killpg(job.pid, signal.SIGKILL)
        return Ended(job.wait(), self.out.read_text())

    def watch(self, job: subprocess.Popen) -> Iterator[None]:
        """A turn every now and then until a run ends. Raises: TimeoutError: it hangs, and was killed."""
        end = time.monotonic() + PATIENCE
        while job.poll() is None:
            if time.monotonic() > end:
                raise TimeoutError(self.kill(job).describe())
            yield
            time.sleep(POLL)

    def wait_for_stage(self, job: subprocess.Popen, stages: set[str]) -> None:
        """Wait until a run begins one of the stages, or ends. Raises: TimeoutError: it does neither."""
        for _ in self.watch(job):
            if stages & {START, *list_rules(self.out.read_text())}:
                return

    def find_script(self, rule: str) -> psutil.Process | None:
        """The process of a job of this run."""
        for process in psutil.process_iter():
            try:
                script = "".join(process.cmdline()[1:2])  # of Python, not of the shell that may be between
                ours = ".snakemake/scripts/" in script and script.endswith(f".{rule}.py")
                if ours and Path(process.cwd()) == self.folder:
                    return process
            except (psutil.Error, OSError):
                continue
        return None

    def digests(self) -> dict[str, str]:
        """Of every file of the scene; hidden ones are what is left of a job that was ended."""
        results = self.folder / "results/desert"
        files = [p for p in sorted(results.rglob("*")) if p.is_file() and p.name != ".snakemake_timestamp"]
        return {p.relative_to(results).as_posix(): digest_files(p) for p in files}

    def find_differences(self, wanted: Reference, what: str, whole: bool = True) -> list[str]:
        """Complaints: files that are different or more than wanted; whole: or missing, after a run that went on.

        Before that, hidden files may lie there, for which nothing looks.
        """
        found, right = self.digests(), wanted.digests
        visible = {name for name in found if whole or not any(part.startswith(".") for part in Path(name).parts)}
        parts = {
            "missing": sorted(right.keys() - visible) if whole else [],
            "more": sorted(visible - right.keys()),
            "different": sorted(name for name in visible & right.keys() if found[name] != right[name]),
        }
        return [f"{what}: {how} {', '.join(names[:5])}" for how, names in parts.items() if names]

    def finish(self, wanted: Reference, what: str) -> list[str]:
        """Let the run go on to its end. Complaints: it does not, or its bytes are not those of the undisturbed run."""
        ended = self.run()
        complaints = [f"{what}: did not go on: {ended.describe()}"] if ended.status else []
        return complaints + self.find_differences(wanted, what)

    def record(self) -> Reference:
        """Run undisturbed, and measure how long each stage takes."""
        begun = {START: time.monotonic()}
        job = self.start()
        for _ in self.watch(job):
            for rule in list_rules(self.out.read_text()):
                begun.setdefault(rule, time.monotonic())
        ended = Ended(job.wait(), self.out.read_text())
        if ended.status:
            raise RuntimeError(f"the undisturbed run failed: {ended.said}")
        times = [*begun.values(), time.monotonic()]
        lasted = [end - start for start, end in zip(times, times[1:], strict=False)]
        return Reference(self.digests(), dict(zip(begun, lasted, strict=True)))


def list_rules(said: str) -> list[str]:
    """Rules whose jobs began, in order, from what a run printed: "[3 of 18] fit_coarse"."""
    return re.findall(r"^\[\d+ of \d+\] (\w+)$", said, re.M)
