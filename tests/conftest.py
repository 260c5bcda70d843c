"""What all tests share: where the repository is, the real photos where they are at hand, one headless Chromium."""

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
def shared():
    """The folder of photos and tools beside the repository; tests that need it are skipped where it is not."""
    folder = ROOT.parent / "shared"
    if not (folder / "data").is_dir():
        pytest.skip(f"needs the real photos in {folder.name}/data beside the repository")
    return folder


@pytest.fixture(scope="session")
def chromium():
    playwright = pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
    if not (path := chromium_path()):
        pytest.skip("no chromium on this machine: apt-get install chromium")
    with playwright.sync_playwright() as started:
        browser = started.chromium.launch(executable_path=path, args=FLAGS)
        yield browser
        browser.close()
