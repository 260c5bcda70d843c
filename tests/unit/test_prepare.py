import subprocess
import sys


def prepared(root, folder):
    """What the check before the set-up says on a machine whose programs all lie in one folder."""
    command = [sys.executable, root / "workflow/prepare.py"]
    return subprocess.run(command, cwd=folder, env={"PATH": str(folder)}, capture_output=True, text=True, check=False)


def test_a_missing_compiler_is_named_with_its_package(root, tmp_path):
    done = prepared(root, tmp_path)
    assert done.returncode == 1
    assert "g++" in done.stderr and "sudo apt install" in done.stderr and "Traceback" not in done.stderr


def test_a_compiler_that_is_there_is_not_asked_for(root, tmp_path):
    (tmp_path / "c++").write_text("#!/bin/sh\n")
    (tmp_path / "c++").chmod(0o755)
    assert "g++" not in prepared(root, tmp_path).stderr
