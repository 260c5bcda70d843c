"""`make run`: what it lays over the config, one run at a time in a folder, and how a run ends."""

import signal
import subprocess
import sys

import pytest
from fixtures.configs import checked_config

from dav_gswt.cli import run
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
    assert run.select_overlays(root) == [root / run.SMALLER]
    monkeypatch.setattr(run, "follow", lambda command, folder: (1, 0))
    run.run_workflow("desert", 1, [])
    assert "slower" in (said := capsys.readouterr().out) and "it was not built" in said
    usual, small = (checked_config(*files)["presets"] for files in ((), (run.SMALLER,)))
    assert all(small[name]["max_gaussians"] < usual[name]["max_gaussians"] for name in usual)


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


def test_sigterm_ends_a_command_without_a_stack_trace(monkeypatch):
    """`python -c` stands for the command line, which loads COLMAP with its own handler of signals."""
    command = (
        "from dav_gswt import cli; import pycolmap, signal, types; exit(cli.run_safely(types.SimpleNamespace(run={})))"
    )
    asked = command.format("lambda _: signal.raise_signal(signal.SIGTERM)")
    done = subprocess.run([sys.executable, "-c", asked], capture_output=True, check=False)
    assert (done.returncode, done.stderr) == (130, b"")


@pytest.mark.parametrize("handler", ["signal.default_int_handler", "signal.SIG_IGN"])
def test_snakemake_tidies_up_after_jobs_that_end_and_after_those_that_are_killed(monkeypatch, handler):
    monkeypatch.setattr(run, "GRACE", 600.0 if "default" in handler else 1.0)
    job = start(handler)
    run.end_run(job, signal.SIGTERM)
    assert job.communicate()[0] == "tidied\n" and job.returncode == 0


def test_what_does_not_end_is_killed(monkeypatch):
    monkeypatch.setattr(run, "GRACE", 0.3)
    job = start("signal.SIG_IGN", "time.sleep(600)")
    run.end_run(job, signal.SIGTERM)
    assert job.wait() == -signal.SIGKILL


def test_a_lock_of_a_killed_run_is_removed_and_that_of_a_living_one_is_not(tmp_path, monkeypatch, capsys):
    (tmp_path / ".snakemake/locks").mkdir(parents=True)
    (tmp_path / ".snakemake/locks/0.input.lock").touch()
    monkeypatch.chdir(tmp_path)
    commands = []
    monkeypatch.setattr(run.subprocess, "run", lambda command, **_: commands.append(command))
    monkeypatch.setattr(run, "follow", lambda command, root: (1, 0))
    with start("signal.default_int_handler") as job:
        with pytest.raises(InputError, match=rf"another run works in this folder \(process {job.pid}\)"):
            run.run({"scene": "desert"}, 1, [])
        assert not commands
        run.end_run(job, signal.SIGTERM)
    assert run.run({"scene": "desert"}, 1, []) == 1
    assert commands[0][-1] == "--unlock" and "cut short" in capsys.readouterr().out


def test_a_user_without_name_and_home_gets_both_in_the_folder(tmp_path, monkeypatch):
    """As in a container: no entry in /etc/passwd, and a home that is nobody's."""
    monkeypatch.setattr(run.getpass, "getuser", lambda: {}["uid not found"])
    monkeypatch.setattr(run.os, "access", lambda path, mode: path != tmp_path)
    for name in ("XDG_CACHE_HOME", "XDG_CONFIG_HOME"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv("HOME", str(tmp_path))
    found = run.replace_missing_user(tmp_path / "run")
    assert found["USER"].startswith("user") and found["XDG_CACHE_HOME"].startswith(str(tmp_path / "run"))
    monkeypatch.undo()
    monkeypatch.setenv("HOME", str(tmp_path))
    monkeypatch.setenv("USER", "me")
    assert not run.replace_missing_user(tmp_path / "run")


def test_a_python_that_snakemake_cannot_start_is_named_before_any_job(monkeypatch):
    monkeypatch.setattr(run.sys, "executable", "/home/me/My Projects/.venv/bin/python")
    with pytest.raises(InputError, match="My Projects.*without them"):
        run.run_workflow("desert", 1, [])
