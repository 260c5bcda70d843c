"""The set-up on machines that lack something: what is said, and what is installed without it."""

import re
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest
from packaging.specifiers import SpecifierSet

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


def prepared_as(root, folder, version="3.12.1", processor="x86_64", before="") -> subprocess.CompletedProcess:
    """What the check says to a Python of that version on that processor. before: Python that is run first."""
    pretended = f"""import ctypes, platform, runpy, sys
{before}
platform.python_version, platform.machine = lambda: {version!r}, lambda: {processor!r}
sys.version_info, sys.argv = ({version.replace(".", ", ")}, "final", 0), ["prepare.py"]
runpy.run_path({str(root / "workflow/prepare.py")!r}, run_name="__main__")"""
    command = [sys.executable, "-c", pretended]
    return subprocess.run(command, cwd=folder, env={"PATH": str(folder)}, capture_output=True, text=True, check=False)


@pytest.mark.parametrize("version", [f"3.{minor}.0" for minor in range(8, 18)])
def test_a_python_that_the_project_does_not_support_is_refused_in_one_line(root, tmp_path, version):
    project = tomllib.loads((root / "pyproject.toml").read_text("utf-8"))["project"]
    done = prepared_as(root, tmp_path, version)
    if version in SpecifierSet(project["requires-python"]):
        assert done.returncode == 0
        assert f"Programming Language :: Python :: {version[:-2]}" in project["classifiers"]
    else:
        assert done.returncode == 1
        assert re.fullmatch(rf"Python {version} is too (old|new): 3\.11, .* is needed \(.*\)\n", done.stderr)


def test_a_processor_that_has_no_pycolmap_is_refused_in_one_line(root, tmp_path):
    done = prepared_as(root, tmp_path, processor="aarch64")
    assert done.returncode == 1 and "Linux on aarch64 is not supported" in done.stderr
    assert done.stderr.count("\n") == 1


def test_a_missing_system_library_is_named_with_its_package(root, tmp_path):
    """Without it Mitsuba ends with a NameError that names no library."""
    done = prepared_as(root, tmp_path, before="def fail(name): raise OSError(name)\nctypes.CDLL = fail")
    assert done.returncode == 1
    assert done.stderr == "Missing on this machine: libatomic1. On Debian or Ubuntu: sudo apt install libatomic1\n"


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
