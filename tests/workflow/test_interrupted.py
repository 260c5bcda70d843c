"""A run that ends early: on a signal, killed, or on a full disk. Nothing half made stays, and the next run goes on."""

import os
import re
import resource
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import psutil
import pytest
from fixtures.runs import TINY

from dav_gswt.files import digest_files

pytestmark = pytest.mark.slow
ARGUMENTS = ("--cores", "1", "--configfile", TINY)
ALONE = {"DAV_GSWT_THREADS": "1", "OMP_NUM_THREADS": "1"}
BRANCH = "results/desert/seed0/draft"
ROUND = f"{BRANCH}/active_farthest_none_pdrop0_lam0_k2/iter1"


@dataclass(frozen=True)
class Ended:
    """A run that was ended early. left: files under results when it had ended."""

    status: int
    out: str
    left: frozenset[str]


@dataclass(frozen=True)
class Story:
    """One desert in four runs, with one thread: ended by Ctrl-C, told to end, killed with all its jobs, and let run."""

    folder: Path
    stopped: Ended
    told: Ended  # SIGTERM to the run's process alone
    killed: Ended
    last: subprocess.CompletedProcess
    again: subprocess.CompletedProcess  # with nothing left to do


def files(folder: Path) -> frozenset[str]:
    return frozenset(str(p.relative_to(folder)) for p in (folder / "results").rglob("*") if p.is_file())


@pytest.fixture(scope="module")
def ended(tmp_path_factory) -> Callable[..., Ended]:
    """Begin a run, and after a rule begins send a signal to it and its jobs, as a terminal does, or to it alone."""

    def call(folder: Path, rule: str, number: int, alone: bool = False) -> Ended:
        command = [sys.executable, "-m", "dav_gswt.cli.run", *ARGUMENTS]
        out, begun = tmp_path_factory.mktemp("out") / "out", time.time()
        with out.open("w") as file:
            job = subprocess.Popen(
                command, cwd=folder, stdout=file, stderr=file, start_new_session=True, env=os.environ | ALONE
            )
        end = time.monotonic() + 200
        logs = folder / "results/logs"  # a job begins its log when it begins
        while not any(log.stat().st_mtime >= begun for log in logs.rglob(f"{rule}.log")):
            assert job.poll() is None and time.monotonic() < end, out.read_text()
            time.sleep(0.05)
        time.sleep(0.5)  # into the job, which has its imports to do
        jobs = psutil.Process(job.pid).children(recursive=True)
        (os.kill if alone else os.killpg)(job.pid, number)
        status = job.wait(60)
        if alone:
            assert not [each for each in jobs if each.is_running() and each.status() != psutil.STATUS_ZOMBIE]
        return Ended(status, out.read_text(), files(folder))

    return call


@pytest.fixture(scope="module")
def story(checkout, run, ended, tmp_path_factory) -> Story:
    folder = checkout(tmp_path_factory.mktemp("story"))
    stopped = ended(folder, "fit_coarse", signal.SIGINT)
    told = ended(folder, "fit_coarse", signal.SIGTERM, alone=True)
    assert not list(folder.glob(".snakemake/locks/*"))
    killed = ended(folder, "capture_views", signal.SIGKILL)
    assert any((folder / ".snakemake/locks").iterdir())
    last = run(folder, *ARGUMENTS, env=ALONE)
    again = run(folder, *ARGUMENTS)
    return Story(folder, stopped, told, killed, last, again)


@pytest.mark.parametrize("way", ["stopped", "told"])
def test_a_stopped_run_says_how_to_go_on(story, way):
    ended = getattr(story, way)
    assert ended.status == 130
    assert "Traceback" not in ended.out
    assert ended.out.rstrip().endswith("Stopped. The same command goes on where this ended.")


@pytest.mark.parametrize("way", ["stopped", "told"])
def test_a_stopped_run_leaves_what_is_whole_and_nothing_half_made(story, way):
    ended = getattr(story, way)
    assert f"{BRANCH.rsplit('/', 1)[0]}/views.json" in ended.left
    left = {name.removeprefix(f"{BRANCH}/coarse/") for name in ended.left if name.startswith(f"{BRANCH}/coarse")}
    assert left in (
        set(),
        {"field.ply", "ground.exr", "fit.json"},
    )  # on a busy machine the fit may have ended meanwhile


def test_a_stopped_run_goes_on_where_it_was(story):
    assert "render the photos" not in story.killed.out and "set test photos aside" not in story.killed.out
    assert re.search(r"\[1 of \d+\] fit the ground: \d+ s\n", story.killed.out)


def test_a_killed_run_leaves_no_capture_that_looks_whole(story):
    assert story.killed.status == -signal.SIGKILL
    assert f"{ROUND}/poses.json" in story.killed.left and f"{ROUND}/capture/capture.json" not in story.killed.left


def test_the_lock_of_a_killed_run_does_not_stop_the_next_one(story):
    assert story.last.returncode == 0, story.last.stdout
    assert "The last run was cut short; going on where it stopped." in story.last.stdout
    assert "] take photos" in story.last.stdout and "] fit the ground:" not in story.last.stdout


def test_what_is_said_at_the_end_is_there(story):
    named = [word for word in story.last.stdout.split() if word.startswith("results/")]
    assert len(named) == 4 and all(list(story.folder.glob(word)) for word in named)
    assert len(list(story.folder.glob(next(word for word in named if word.endswith("*.png"))))) == 3


def test_a_run_with_nothing_to_do_says_so(story):
    assert story.again.returncode == 0 and "Up to date, nothing to do." in story.again.stdout
    assert "] " not in story.again.stdout


def test_interruptions_and_threads_leave_no_trace_in_the_bytes(story, tiny):
    """The same seed gives the same bytes, whether in one go on two threads or in three on one."""
    made = [p for p in (tiny.folder / "results/desert").rglob("*") if p.is_file() and not p.name.startswith(".")]
    assert {"field.ply", "level0.bin", "davgswt.json", "walker.png", "uncertainty.exr"} <= {p.name for p in made}
    differ = [p for p in made if digest_files(p) != digest_files(story.folder / p.relative_to(tiny.folder))]
    assert not differ


@pytest.mark.parametrize("what", ["snakemake", "/a/.snakemake/scripts/tmp1.fit_coarse.py"])
def test_a_run_beside_another_is_refused(checkout, run, tmp_path, what):
    """A lock with a living run behind it is left alone; so it is with a job that outlived its run."""
    folder = checkout(tmp_path)
    (folder / ".snakemake/locks").mkdir(parents=True)
    (folder / ".snakemake/locks/0.input.lock").write_text("results\n")
    other = subprocess.Popen([sys.executable, "-c", "input()", what], cwd=folder, stdin=subprocess.PIPE)
    try:
        done = run(folder, *ARGUMENTS)
    finally:
        other.communicate(b"\n")
    assert done.returncode == 1 and done.stdout.startswith("another run works in this folder")
    assert (folder / ".snakemake/locks/0.input.lock").exists()


def test_a_full_disk_is_named_and_the_next_run_goes_on(tiny, checkout, snakemake, tmp_path):
    """No file may grow beyond 300 kB; the field has 500 kB. The same fault as a full disk, for any user."""
    folder = checkout(tmp_path / "disk")
    for stage in (tiny.photos, tiny.start / "views.json"):
        place = folder / stage.relative_to(tiny.folder)
        place.parent.mkdir(parents=True, exist_ok=True)
        shutil.copytree(stage, place) if stage.is_dir() else shutil.copy2(stage, place)
    done = subprocess.run(
        [sys.executable, "-m", "dav_gswt.cli.run", *ARGUMENTS],
        cwd=folder,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        check=False,
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (300_000, resource.RLIM_INFINITY)),
    )
    assert done.returncode == 1 and "Traceback" not in done.stdout, done.stdout
    assert re.search(r"field.ply: .*; free some space, then run the same again\n", done.stdout), done.stdout
    assert not [name for name in files(folder) if name.startswith(f"{BRANCH}/coarse")]
    snakemake(folder, "--cores", "1", f"{BRANCH}/coarse/field.ply", configs=("config/config.yaml", TINY))
    assert digest_files(folder / BRANCH / "coarse/field.ply") == digest_files(tiny.coarse / "field.ply")
