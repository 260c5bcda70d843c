"""The project without the folder `study/`: it plans, its tests and its documentation work."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

pytestmark = pytest.mark.slow
TESTS = ["tests/unit/config", "tests/unit/test_docs.py", "tests/unit/test_architecture.py"]
TESTS += ["tests/workflow/test_plans.py"]


@pytest.fixture(scope="module")
def alone(root, tmp_path_factory) -> Path:
    """A copy of the project's tracked files without the study."""
    folder = tmp_path_factory.mktemp("alone")
    listed = subprocess.run(["git", "ls-files", "-z"], cwd=root, capture_output=True, text=True, check=False)
    if listed.returncode:
        pytest.skip("needs a git checkout")
    for name in listed.stdout.split("\0")[:-1]:
        if not name.startswith("study/") and (root / name).exists():
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(root / name, folder / name, follow_symlinks=False)
    return folder


def call(folder: Path, *arguments: str) -> str:
    environment = os.environ | {"NO_MKDOCS_2_WARNING": "1"}
    done = subprocess.run(
        [sys.executable, "-m", *arguments], cwd=folder, capture_output=True, text=True, check=False, env=environment
    )
    assert done.returncode == 0, done.stdout[-3000:] + done.stderr[-3000:]
    return done.stdout


def test_every_test_is_found_and_those_of_plans_config_and_docs_pass(alone):
    assert "tests collected" in call(alone, "pytest", "-q", "--collect-only", "-p", "no:cacheprovider").splitlines()[-1]
    call(alone, "pytest", "-q", "-p", "no:cacheprovider", *TESTS)


def test_its_documentation_is_built(alone):
    call(alone, "mkdocs", "build", "--strict", "--quiet", "--site-dir", str(alone / "site"))
    assert (alone / "site/index.html").is_file()


def test_nothing_of_it_names_the_package_of_the_study(alone):
    files = [*alone.rglob("*.py"), *alone.rglob("*.smk"), alone / "Snakefile", alone / "pyproject.toml"]
    naming = [f for f in files if "dav_gswt_study" in f.read_text("utf-8") and f.name != Path(__file__).name]
    assert len(files) > 300 and not naming
