"""What all tests share: where the repository is, its real photos, one headless Chromium."""

from pathlib import Path

import pytest
from hypothesis import settings

from dav_gswt.study.terrain.browser import FLAGS, chromium_path

ROOT = Path(__file__).parents[1]

settings.register_profile("untimed", deadline=None)  # no test asserts times: machines are shared
settings.load_profile("untimed")


def pytest_collection_modifyitems(items):
    """With several workers (pytest -n), one takes a whole folder: what its tests share is then made once. Whole runs
    come first, as they take longest."""
    items.sort(key=lambda item: "workflow" not in item.path.parts)  # stable: else the order stays
    for item in items:
        item.add_marker(pytest.mark.xdist_group(str(item.path.parent)))


@pytest.fixture(scope="session")
def root():
    return ROOT


@pytest.fixture(scope="session")
def photo_sets():
    """The folder of the real photo sets: `photo_sets / "brighton_beach/images"`."""
    return ROOT / "resources/photos"


@pytest.fixture(scope="session")
def gswt_checker():
    """The public renderer's checker of gswt.zip, where it is at hand."""
    script = ROOT.parent / "shared/tools/check_gswt_zip.py"
    if not script.is_file():
        pytest.skip("the public renderer's checker is not at hand")
    return script


@pytest.fixture(scope="session")
def chromium():
    playwright = pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
    if not (path := chromium_path()):
        pytest.skip("no chromium on this machine: apt-get install chromium")
    with playwright.sync_playwright() as started:
        browser = started.chromium.launch(executable_path=path, args=FLAGS)
        yield browser
        browser.close()
