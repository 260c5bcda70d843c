"""Static checks of the viewer's JavaScript: types by JSDoc (tsc --checkJs --strict), lint rules (Biome).

Both tools are pinned in package-lock.json beside this file; `npm install` fetches them on the first run.
"""

import shutil
import subprocess
from pathlib import Path

import pytest

FOLDER = Path(__file__).parent
VIEWER = FOLDER.parents[1] / "workflow" / "viewer"


@pytest.fixture(scope="module")
def npm():
    """Run a script of package.json; returns the finished process."""
    program = shutil.which("npm")
    if not program:
        pytest.skip("needs npm (Node.js 20 or newer) for the viewer's type checker and linter")

    def run(*arguments: str) -> subprocess.CompletedProcess:
        return subprocess.run([program, *arguments], cwd=FOLDER, capture_output=True, text=True, timeout=300)

    if not (FOLDER / "node_modules" / ".bin" / "tsc").exists():
        installed = run("install", "--no-save", "--no-audit", "--no-fund")
        if installed.returncode:
            pytest.skip(f"npm install --prefix tests/browser does not work here: {installed.stderr[-300:]}")
    return run


def test_types_hold(npm):
    checked = npm("run", "--silent", "types")
    assert checked.returncode == 0, checked.stdout


def test_the_linter_has_nothing_to_say(npm):
    checked = npm("run", "--silent", "lint")
    assert checked.returncode == 0, checked.stdout + checked.stderr


def test_folders_depend_on_each_other_one_way():
    """terrain <- data <- worker, draw <- ui <- main: no module imports one of a later folder."""
    order = ["terrain", "data", "worker", "draw", "ui"]
    for module in VIEWER.rglob("*.js"):
        folder = module.parent.name if module.parent != VIEWER else "ui"
        for line in module.read_text().splitlines():
            if line.startswith(("import ", "} from")) and '"../' in line:
                imported = line.split('"../')[1].split("/")[0]
                assert order.index(imported) <= order.index(folder), f"{module.name}: {line}"


def test_pages_hold_only_what_users_load():
    names = {path.suffix for path in VIEWER.rglob("*") if path.is_file()}
    assert names == {".html", ".css", ".js"}
    assert not list(VIEWER.rglob("test_api.js"))
