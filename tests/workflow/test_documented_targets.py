"""Every target that a page names can be planned in a copy of the repository with nothing beside it."""

import shutil

import pytest
from fixtures import doc_pages
from fixtures.snakemake_calls import call_snakemake


@pytest.fixture(scope="module")
def alone(checkout, root, tmp_path_factory):
    """A copy of the repository, in a folder of its own."""
    folder = checkout(tmp_path_factory.mktemp("alone") / "repository")
    shutil.copytree(root / "resources", folder / "resources")
    shutil.copytree(root / "examples", folder / "examples", ignore=shutil.ignore_patterns("node_modules", "exports"))
    return folder


def plan(folder, *arguments):
    return call_snakemake(["--dry-run", "--quiet", "rules", *arguments], folder)


def test_targets_of_the_pages_are_planned(alone):
    targets = set().union(*(doc_pages.named_targets(page)["snakemake"] for page in doc_pages.pages()))
    assert {"study", "seams", "tradeoff", "view_benchmark", "frame_times", "presort_table"} <= targets
    done = plan(alone, "--", *sorted(targets))
    assert done.returncode == 0, done.stdout


@pytest.mark.parametrize("scene", ["copr_dunes", "brighton_beach", "caliterra_earthworks"])
def test_scenes_of_the_real_photos_are_planned(alone, scene):
    done = plan(alone, "--config", f"scene={scene}")
    assert done.returncode == 0 and "register_photos" in done.stdout, done.stdout
