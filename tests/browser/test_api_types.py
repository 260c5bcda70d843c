"""The written types of the terrain API against those that TypeScript finds in its JavaScript."""

import json
import shutil
import subprocess
from pathlib import Path

import pytest

from dav_gswt.files import write_json

pytestmark = pytest.mark.slow
FOLDER = Path(__file__).parent
VIEWER = FOLDER.parents[1] / "workflow" / "viewer"
SAME = """
import * as made from "./made/terrain_api.js";
import * as written from "./written/terrain_api.js";
const a: typeof written = made, b: typeof made = written;
export { a, b };
"""


def compile_types(project: Path) -> None:
    if not (shutil.which("npm") and (FOLDER / "node_modules/.bin/tsc").exists()):
        pytest.skip("needs TypeScript: install Node.js 20 or newer, then type `make lint`")
    command = ["npm", "exec", "--", "tsc", "--project", project]
    done = subprocess.run(command, cwd=FOLDER, capture_output=True, text=True, timeout=300, check=False)
    assert done.returncode == 0, done.stdout


def test_the_written_types_are_those_of_the_terrain_api(tmp_path):
    """Each can stand for the other, member by member."""
    settings = json.loads((FOLDER / "tsconfig.json").read_text())
    options = settings["compilerOptions"] | {"noEmit": False, "declaration": True, "emitDeclarationOnly": True}
    options |= {"outDir": str(tmp_path / "made"), "rootDir": str(VIEWER)}
    del options["rootDirs"]
    write_json(tmp_path / "make.json", {"compilerOptions": options, "files": [str(VIEWER / "terrain_api.js")]})
    compile_types(tmp_path / "make.json")
    (tmp_path / "written").mkdir()
    (tmp_path / "written/terrain_api.d.ts").write_text((VIEWER / "terrain_api.d.ts").read_text())
    (tmp_path / "same.ts").write_text(SAME)
    options = {key: value for key, value in settings["compilerOptions"].items() if key != "rootDirs"}
    write_json(tmp_path / "tsconfig.json", {"compilerOptions": options, "files": ["same.ts"]})
    compile_types(tmp_path / "tsconfig.json")
