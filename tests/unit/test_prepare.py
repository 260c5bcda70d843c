"""The set-up on machines that lack something: what is said, and what is installed without it."""

import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest


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
    script(tmp_path / "c++")
    assert "g++" not in prepared(root, tmp_path).stdout


def test_a_folder_from_which_snakemake_starts_no_job_is_named_before_the_set_up(root, tmp_path):
    for name, said in (("My Projects", "the path has blanks,"), ("a$(b)", r"the path has \$ \( \),"), ("Düne-1", "")):
        (tmp_path / name).mkdir()
        done = prepared(root, tmp_path / name)
        assert done.returncode == bool(said) and re.search(said, done.stderr) and (said or not done.stderr)


WITHOUT_LIBRARIES = "def fail(name): raise OSError(name)\nctypes.CDLL = fail"


def prepared_as(root, folder, version="3.12.1", processor="x86_64", before="") -> subprocess.CompletedProcess:
    """What the check says to a Python of that version on that processor. before: Python that is run first."""
    pretended = f"""import ctypes, platform, runpy, sys
{before}
platform.python_version, platform.machine = lambda: {version!r}, lambda: {processor!r}
sys.version_info, sys.argv = ({version.replace(".", ", ")}, "final", 0), ["prepare.py"]
runpy.run_path({str(root / "workflow/prepare.py")!r}, run_name="__main__")"""
    command = [sys.executable, "-c", pretended]
    return subprocess.run(command, cwd=folder, env={"PATH": str(folder)}, capture_output=True, text=True, check=False)


@pytest.mark.parametrize(
    "machine, said",
    [
        ({"version": "3.11.0"}, ""),
        ({"version": "3.10.9"}, r"Python 3\.10\.9 is too old: 3\.11, .* is needed \(.*\)\n"),
        ({"version": "3.14.0"}, r"Python 3\.14\.0 is too new: 3\.11, .* is needed \(.*\)\n"),
        ({"processor": "aarch64"}, r"Linux on aarch64 is not supported: .*\n"),
        ({"before": WITHOUT_LIBRARIES}, r"Missing .*: libatomic1\. On Debian or Ubuntu: sudo apt install libatomic1\n"),
    ],
)
def test_a_machine_that_is_not_supported_is_told_so_in_one_line(root, tmp_path, machine, said):
    done = prepared_as(root, tmp_path, **machine)
    assert done.returncode == bool(said) and re.fullmatch(said, done.stderr)


@pytest.mark.skipif(not shutil.which("make"), reason="no make on this machine")
def test_make_run_leaves_the_core_out_until_there_is_a_compiler_and_then_builds_it(root, tmp_path):
    """In a checkout whose pip and python only write down what they are asked for, with nothing but a shell."""
    for part in ("programs", "workflow", ".venv/bin"):
        (tmp_path / part).mkdir(parents=True)
    for tool in ("sh", "grep", "touch", "rm", "echo", "test"):
        (tmp_path / "programs" / tool).symlink_to(shutil.which(tool))
    for name in ("Makefile", "pyproject.toml", "requirements.lock", "workflow/prepare.py"):
        shutil.copy(root / name, tmp_path / name)
    for name in ("pip", "python"):
        script(tmp_path / ".venv/bin" / name, f'echo "{name} $@" >> "{tmp_path}/asked"')

    def make_run() -> list[str]:
        """What pip is asked to do with the project."""
        (tmp_path / "asked").write_text("")
        command = [shutil.which("make"), "run", f"PYTHON={sys.executable}"]
        env = {"PATH": str(tmp_path / "programs")}
        done = subprocess.run(command, cwd=tmp_path, env=env, capture_output=True, text=True, check=False)
        asked = (tmp_path / "asked").read_text().splitlines()
        assert done.returncode == 0 and asked[-1].startswith("python -m dav_gswt.cli.run"), done.stdout + done.stderr
        return [line for line in asked if "--editable" in line]

    (first,) = make_run()
    assert first.endswith("--editable . --config-settings=wheel.cmake=false")
    assert not make_run(), "the set-up is done again though nothing changed"
    script(tmp_path / "programs" / "g++")
    if prepared(tmp_path, tmp_path / "programs", "core").returncode:
        pytest.skip("this Python has no headers: no core can be built with it")
    (then,) = make_run()
    assert then.endswith("--editable .")
    (tmp_path / "programs" / "g++").unlink()
    assert not make_run(), "a core that was built is kept on a machine that lost its compiler"
