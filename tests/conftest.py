"""What all tests share: where the repository is, and the real photos where they are at hand."""

from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]


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
