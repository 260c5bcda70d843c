"""The set-up on machines that lack something: what is said, and what is installed without it."""

import shutil
import subprocess
import sys
from pathlib import Path

import pytest

TOOLS = ("sh", "grep", "touch", "rm", "echo", "test")


def prepared(root, folder, *arguments):
    """What the check before the set-up says on a machine whose programs all lie in one folder."""
    command = [sys.executable, root / "workflow/prepare.py", *arguments]
    return subprocess.run(command, cwd=folder, env={"PATH": str(folder)}, capture_output=True, text=True, check=False)


def script(file: Path, text: str = "") -> None:
    file.write_text(f"#!/bin/sh\n{text}\n")
    file.chmod(0o755)


def test_a_missing_compiler_is_named_with_its_package_and_what_it_costs(root, tmp_path):
    done = prepared(root, tmp_path)
    assert done.returncode == 0 and not done.stderr
    assert "g++" in done.stdout and "sudo apt install" in done.stdout and "slower" in done.stdout
    assert prepared(root, tmp_path, "core").returncode == 1


def test_a_compiler_that_is_there_is_not_asked_for(root, tmp_path):
    script(tmp_path / "c++")
    assert "g++" not in prepared(root, tmp_path).stdout


@pytest.fixture
def machine(root, tmp_path):
    """A checkout with a .venv whose pip and python only write down what they are asked for, on a machine with nothing
    but a shell. Returns a function that types `make run` there and says what pip was asked to do with the project."""
    if not shutil.which("make"):
        pytest.skip("no make on this machine")
    programs = tmp_path / "programs"
    programs.mkdir()
    for tool in TOOLS:
        (programs / tool).symlink_to(shutil.which(tool))
    for name in ("Makefile", "pyproject.toml", "requirements.lock", "requirements-weights.lock"):
        shutil.copy(root / name, tmp_path)
    (tmp_path / "workflow").mkdir()
    shutil.copy(root / "workflow/prepare.py", tmp_path / "workflow")
    (tmp_path / ".venv/bin").mkdir(parents=True)
    log = tmp_path / "asked"
    for name in ("pip", "python"):
        script(tmp_path / ".venv/bin" / name, f'echo "{name} $@" >> "{log}"')

    def make_run() -> list[str]:
        log.write_text("")
        command = [shutil.which("make"), "run", f"PYTHON={sys.executable}"]
        env = {"PATH": str(programs)}
        done = subprocess.run(command, cwd=tmp_path, env=env, capture_output=True, text=True, check=False)
        asked = log.read_text().splitlines()
        assert done.returncode == 0 and asked[-1].startswith("python -m dav_gswt.cli.run"), done.stdout + done.stderr
        return [line for line in asked if "--editable" in line]

    return make_run


def test_make_run_leaves_the_core_out_until_there_is_a_compiler_and_then_builds_it(machine, tmp_path):
    (first,) = machine()
    assert first.endswith("--editable . --config-settings=wheel.cmake=false")
    assert not machine(), "the set-up is done again though nothing changed"
    script(tmp_path / "programs" / "g++")
    if prepared(tmp_path, tmp_path / "programs", "core").returncode:
        pytest.skip("this Python has no headers: no core can be built with it")
    (then,) = machine()
    assert then.endswith("--editable .")
    assert not machine()
    (tmp_path / "programs" / "g++").unlink()
    assert not machine(), "a core that was built is kept on a machine that lost its compiler"
