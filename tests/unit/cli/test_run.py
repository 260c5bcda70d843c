"""`make run`: what it lays over the config, one run at a time in a folder, and how a run ends."""

import os
import re
import signal
import subprocess
import sys
import time

import pytest

from dav_gswt.cli import interruption, run
from dav_gswt.cli.working_folder import LOCK, hold_folder, redate_files
from dav_gswt.errors import InputError
from dav_gswt.raster import backends


@pytest.fixture
def without_core(monkeypatch):
    real = backends.explain_unavailable
    monkeypatch.delenv(backends.VARIABLE, raising=False)
    monkeypatch.setattr(
        backends, "explain_unavailable", lambda name: real(name) if name == "torch" else "it was not built"
    )


def test_where_the_core_is_missing_a_smaller_size_is_printed_and_used(without_core, root, monkeypatch, capsys):
    assert run.select_overlays(quietly=False) == [run.SMALLER]
    assert "slower" in (said := capsys.readouterr().out) and "it was not built" in said
    assert run.select_overlays(quietly=True) == [run.SMALLER] and not capsys.readouterr().out
    monkeypatch.chdir(root)
    usual, small = (run.load_config(files)["presets"] for files in ([], [run.SMALLER]))
    assert all(small[name]["max_gaussians"] < usual[name]["max_gaussians"] for name in run.list_presets([]))


def test_an_entry_with_a_name_of_the_study_is_refused(root, tmp_path, monkeypatch):
    """The study's would go before it, and nothing would say so."""
    (tmp_path / "config").symlink_to(root / "config")
    monkeypatch.chdir(tmp_path)
    text = re.sub(r"(?m)^(tilings:.*)$", r"\1\n  semantic: {tile: 0.3}", (root / "config/config.yaml").read_text())
    (tmp_path / "own.yaml").write_text(text)
    monkeypatch.setattr(run, "CONFIG", tmp_path / "own.yaml")
    with pytest.raises(InputError, match=r"own\.yaml: tilings\.semantic: config/study\.yaml has an entry of this name"):
        run.load_config([])


HOLD = "import sys, pathlib\nfrom dav_gswt.cli.working_folder import hold_folder\n"
HOLD += "with hold_folder(pathlib.Path(sys.argv[1])):\n    print(flush=True)\n    input()"


@pytest.fixture
def holder(tmp_path):
    """A process that holds a folder."""
    with subprocess.Popen(
        [sys.executable, "-c", HOLD, tmp_path], stdin=subprocess.PIPE, stdout=subprocess.PIPE
    ) as process:
        process.stdout.readline()
        yield process
        process.kill()


def test_a_folder_is_held_by_one_process_which_is_named(holder, tmp_path):
    said = rf"another run works in this folder \(process {holder.pid}\)"
    with pytest.raises(InputError, match=said), hold_folder(tmp_path):
        pass
    holder.kill()
    holder.wait()
    for _ in range(2):  # a killed process holds nothing
        with hold_folder(tmp_path):
            assert (tmp_path / LOCK).read_text() == str(os.getpid())


def test_files_from_the_future_are_dated_now(tmp_path):
    paths = [tmp_path / "old", tmp_path / "ahead", tmp_path / "folder/.hidden"]
    paths[2].parent.mkdir()
    for path, age in zip(paths, (-60, 3600, 86400), strict=True):
        path.write_text("")
        os.utime(path, (0, time.time() + age))
    os.utime(paths[2].parent, (0, time.time() + 3600))
    old = paths[0].stat().st_mtime
    assert redate_files(tmp_path) == 2
    assert paths[0].stat().st_mtime == old
    assert max(path.stat().st_mtime for path in tmp_path.rglob("*")) <= time.time()


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
