"""What all tests share: the repository, its real photos, one headless Chromium, the list of skipped tests."""

import signal
from collections import Counter
from pathlib import Path

import pytest
from hypothesis import settings

from dav_gswt.study.terrain.browser import FLAGS, chromium_path

ROOT = Path(__file__).parents[1]
pytest_plugins = ["fixtures.workflow_runs"]

settings.register_profile("untimed", deadline=None)  # no test asserts times: machines are shared
settings.load_profile("untimed")


# a shell that starts a command in the background has it ignore Ctrl-C, and so would the runs that tests interrupt
signal.signal(signal.SIGINT, signal.default_int_handler)


def pytest_terminal_summary(terminalreporter):
    """List what was not tested, and how to install what is missing."""
    reasons = Counter(
        report.longrepr[2].removeprefix("Skipped: ") for report in terminalreporter.stats.get("skipped", [])
    )
    if reasons:
        terminalreporter.section("not tested on this machine")
    for reason, count in sorted(reasons.items()):
        terminalreporter.write_line(f"{count} test{'s' if count > 1 else ''}: {reason}")


@pytest.fixture(scope="session")
def root():
    return ROOT


@pytest.fixture(scope="session")
def photo_sets():
    """The folder of the real photo sets: `photo_sets / "brighton_beach/images"`."""
    return ROOT / "resources/photos"


@pytest.fixture(scope="session")
def gswt_checker():
    """The public renderer's checker of gswt.zip, if it is there."""
    script = ROOT.parent / "shared/tools/check_gswt_zip.py"
    if not script.is_file():
        pytest.skip("needs the checker of the public renderer, which is not part of the repository")
    return script


@pytest.fixture(scope="session")
def playwright():
    """What starts browsers; there can be one in a session."""
    module = pytest.importorskip("playwright.sync_api", reason="needs playwright: pip install playwright")
    with module.sync_playwright() as started:
        yield started


@pytest.fixture(scope="session")
def chromium(playwright):
    if not (path := chromium_path()):
        pytest.skip("needs Chromium: apt-get install chromium")
    browser = playwright.chromium.launch(executable_path=path, args=FLAGS)
    yield browser
    browser.close()
