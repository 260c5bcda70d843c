"""Static checks of the viewer's JavaScript: types by JSDoc (tsc --checkJs --strict), lint rules (Biome).

Both tools are pinned in package-lock.json beside this file; `npm install` fetches them on the first run.
"""

import json
import shutil
import subprocess
from pathlib import Path

import pytest

from dav_gswt.files import write_json

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


SAME = """
import * as made from "./made/terrain_api.js";
import * as written from "./written/terrain_api.js";
const a: typeof written = made, b: typeof made = written;
export { a, b };
"""


def test_the_written_types_are_those_of_the_terrain_api(npm, tmp_path):
    """terrain_api.d.ts against what tsc makes of the JavaScript: each can stand for the other, member by member."""
    settings = json.loads((FOLDER / "tsconfig.json").read_text())
    options = settings["compilerOptions"] | {"noEmit": False, "declaration": True, "emitDeclarationOnly": True}
    options |= {"outDir": str(tmp_path / "made"), "rootDir": str(VIEWER)}
    del options["rootDirs"]
    write_json(tmp_path / "make.json", {"compilerOptions": options, "files": [str(VIEWER / "terrain_api.js")]})
    made = npm("exec", "--", "tsc", "--project", str(tmp_path / "make.json"))
    assert made.returncode == 0, made.stdout
    (tmp_path / "written").mkdir()
    (tmp_path / "written/terrain_api.d.ts").write_text((VIEWER / "terrain_api.d.ts").read_text())
    (tmp_path / "same.ts").write_text(SAME)
    options = {key: value for key, value in settings["compilerOptions"].items() if key != "rootDirs"}
    write_json(tmp_path / "tsconfig.json", {"compilerOptions": options, "files": ["same.ts"]})
    checked = npm("exec", "--", "tsc", "--project", str(tmp_path / "tsconfig.json"))
    assert checked.returncode == 0, checked.stdout


def test_the_linter_has_nothing_to_say(npm):
    checked = npm("run", "--silent", "lint")
    assert checked.returncode == 0, checked.stdout + checked.stderr


def test_folders_depend_on_each_other_one_way():
    """terrain <- data <- worker, draw <- scene <- api, ui: no module imports one of a later folder."""
    order = ["terrain", "data", "worker", "draw", "scene", "api", "ui"]
    for module in VIEWER.rglob("*.js"):
        folder = module.parent.name if module.parent != VIEWER else "ui"
        for line in module.read_text().splitlines():
            if line.startswith(("import ", "} from")) and '"../' in line:
                imported = line.split('"../')[1].split("/")[0]
                assert order.index(imported) <= order.index(folder), f"{module.name}: {line}"


def test_pages_hold_only_what_users_load():
    names = {path.suffix for path in VIEWER.rglob("*") if path.is_file()}
    assert names == {".html", ".css", ".js", ".ts"}
    assert not list(VIEWER.rglob("test_api.js"))
