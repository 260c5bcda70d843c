"""The structure of the code: types, one-way arrows between packages, and sizes."""

import json
import re
import subprocess
import sys

import pytest

SCRIPTS_WITHOUT_TORCH = {
    *("bundle_tiles", "capture_views", "find_materials", "fit_coarse", "make_levels", "make_page", "render_photos"),
    *("render_terrain", "report_photos", "select_poses", "split_views", "update_field"),
}


def test_the_library_and_the_scripts_are_typed(root):
    """pyright in standard mode, as pyproject.toml sets it up."""
    command = [sys.executable, "-m", "pyright", "--outputjson"]
    done = subprocess.run(command, cwd=root, capture_output=True, text=True, check=False)
    if not done.stdout.startswith("{"):
        pytest.skip(f"pyright cannot run here: {done.stderr.strip()[-200:]}")
    errors = [each for each in json.loads(done.stdout)["generalDiagnostics"] if each["severity"] == "error"]
    assert errors == []


def test_arrows_between_packages_point_one_way(root):
    """import-linter with the contracts of pyproject.toml."""
    command = [sys.executable, "-c", "from importlinter.cli import lint_imports_command as run; run()"]
    done = subprocess.run(command, cwd=root, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout[-4000:] + done.stderr[-1000:]


def test_modules_have_less_than_400_lines(root):
    files = (root / "workflow/lib").rglob("*.py")
    assert [file.name for file in files if len(file.read_text(encoding="utf-8").splitlines()) >= 400] == []


def test_scripts_are_short(root):
    files = (root / "scripts").rglob("*.py")
    assert [file.name for file in files if len(file.read_text(encoding="utf-8").splitlines()) > 30] == []


def test_the_snakefile_has_less_than_60_lines(root):
    assert len((root / "Snakefile").read_text(encoding="utf-8").splitlines()) < 60


def test_the_experiment_has_less_than_80_lines(root):
    assert len((root / "config/config.yaml").read_text(encoding="utf-8").splitlines()) < 80


def test_each_rule_runs_the_script_of_its_own_room(root):
    """Rules of the product run no script of the study."""
    for file in (root / "rules").glob("*.smk"):
        assert not re.search(r"scripts/study", file.read_text(encoding="utf-8")), file.name


@pytest.mark.parametrize("folder", ["scripts", "rules"])
def test_nothing_outside_the_study_reads_it(root, folder):
    """Scripts and rules; import-linter holds the library to it."""
    files = [path for path in (root / folder).iterdir() if path.suffix in (".py", ".smk")]
    assert files and not [path.name for path in files if "dav_gswt.study" in path.read_text()]


@pytest.mark.parametrize("script", sorted(SCRIPTS_WITHOUT_TORCH))
def test_a_job_without_networks_does_not_load_torch(root, script):
    """Loading it takes longer than many jobs work."""
    lines = (root / f"scripts/{script}.py").read_text(encoding="utf-8").splitlines()
    imports = [line for line in lines if line.startswith(("import ", "from "))]
    code = "\n".join([*imports, "import sys", "print('torch' in sys.modules)"])
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.stdout == "False\n", done.stderr[-1000:]
