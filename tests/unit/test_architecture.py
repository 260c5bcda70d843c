"""The structure of the code: what linters do not check."""

import subprocess
import sys

import pytest

SCRIPTS_WITHOUT_TORCH = {
    *("bundle_tiles", "capture_views", "find_materials", "fit_coarse", "make_levels", "make_page", "render_photos"),
    *("render_terrain", "report_photos", "select_poses", "split_views", "update_field"),
}


def test_folders_of_the_viewer_depend_on_each_other_one_way(root):
    """terrain <- data <- worker, draw <- scene <- api, ui: no module imports one of a later folder."""
    order, viewer = ["terrain", "data", "worker", "draw", "scene", "api", "ui"], root / "workflow/viewer"
    for module in viewer.rglob("*.js"):
        folder = module.parent.name if module.parent != viewer else "ui"
        for line in module.read_text().splitlines():
            if line.startswith(("import ", "} from")) and '"../' in line:
                imported = line.split('"../')[1].split("/")[0]
                assert order.index(imported) <= order.index(folder), f"{module.name}: {line}"


@pytest.mark.slow
@pytest.mark.parametrize("script", sorted(SCRIPTS_WITHOUT_TORCH))
def test_a_job_without_networks_does_not_load_torch(root, script):
    """Loading it takes longer than many jobs work."""
    lines = (root / f"scripts/{script}.py").read_text(encoding="utf-8").splitlines()
    imports = [line for line in lines if line.startswith(("import ", "from "))]
    code = "\n".join([*imports, "import sys", "print('torch' in sys.modules)"])
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.stdout == "False\n", done.stderr[-1000:]
