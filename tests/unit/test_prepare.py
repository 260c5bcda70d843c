import subprocess
import sys


def test_a_missing_compiler_is_named_with_its_package(root, tmp_path):
    done = subprocess.run(
        [sys.executable, root / "workflow/prepare.py"],
        cwd=tmp_path,
        env={"PATH": str(tmp_path)},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 1
    assert "g++" in done.stderr and "sudo apt install" in done.stderr and "Traceback" not in done.stderr


def test_a_machine_that_has_all_is_let_through(root, tmp_path):
    (tmp_path / "c++").write_text("#!/bin/sh\n")
    (tmp_path / "c++").chmod(0o755)
    done = subprocess.run(
        [sys.executable, root / "workflow/prepare.py"],
        cwd=tmp_path,
        env={"PATH": str(tmp_path)},
        capture_output=True,
        text=True,
        check=False,
    )
    assert "g++" not in done.stderr
