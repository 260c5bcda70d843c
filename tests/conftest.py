"""What all tests share: where the repository is, its real photos, one headless Chromium."""

import signal
from pathlib import Path

import pytest
from hypothesis import settings

from dav_gswt.study.terrain.browser import FLAGS, chromium_path

ROOT = Path(__file__).parents[1]

settings.register_profile("untimed", deadline=None)  # no test asserts times: machines are shared
settings.load_profile("untimed")


# a shell that starts a command in the background has it ignore Ctrl-C, and so would the runs that tests interrupt
signal.signal(signal.SIGINT, signal.default_int_handler)

GROUPS = {  # of tests/workflow, beside "runs"
    "plans": {"test_plans.py", "test_documented_targets.py", "test_profiles.py", "test_snakemake_internals.py"},
    "disturbed runs": {"test_interrupted.py", "test_slurm.py"},
}


_GROUP_OF_FILE = {name: group for group, files in GROUPS.items() for name in files}


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config, log):
    """With several workers (pytest -n), one takes a whole group: what its tests share is then made once.

    A group is a folder; whole runs are two groups, and plans share nothing with them.
    """
    from xdist.scheduler import LoadScopeScheduling

    class GroupScheduling(LoadScopeScheduling):
        def _split_scope(self, nodeid):
            folder, name = nodeid.split("::")[0].rsplit("/", 1)
            return _GROUP_OF_FILE.get(name, "runs") if folder == "tests/workflow" else folder

    return GroupScheduling(config, log)


def pytest_collection_modifyitems(items):
    """Whole runs come first, as they take longest, then the check of types, which else one worker ends with."""
    folders = [ROOT / "tests/workflow", ROOT / "tests/unit"]
    rank = {folder: k for k, folder in enumerate(folders)}
    items.sort(key=lambda item: rank.get(item.path.parent, len(rank)))  # stable: else the order stays


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
def playwright():
    """What starts browsers; there can be one in a session."""
    module = pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
    with module.sync_playwright() as started:
        yield started


@pytest.fixture(scope="session")
def chromium(playwright):
    if not (path := chromium_path()):
        pytest.skip("no chromium on this machine: apt-get install chromium")
    browser = playwright.chromium.launch(executable_path=path, args=FLAGS)
    yield browser
    browser.close()
