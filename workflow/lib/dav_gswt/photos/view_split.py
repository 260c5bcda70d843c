"""views.json: the start views, the candidates that a policy may request, and the test views."""

from dataclasses import asdict, dataclass
from pathlib import Path

from dav_gswt.files import read_record, write_json

TEST_SHARE = 0.1  # of the photos
LEAST_TEST = 2
LEAST_WITH_TEST = 6  # photos, below which none can be spared for testing


def count_tests(photos: int) -> int:
    """How many of so many photos test: about one in ten, at least two, none of few."""
    return 0 if photos < LEAST_WITH_TEST else max(LEAST_TEST, round(TEST_SHARE * photos))


@dataclass(frozen=True)
class ViewSplit:
    """Names of images. start: of the first fit. pool: those that a replay may capture. test: for evaluation alone."""

    start: tuple[str, ...]
    pool: tuple[str, ...]
    test: tuple[str, ...]


def write_view_split(path: Path | str, split: ViewSplit) -> None:
    """Write views.json."""
    write_json(path, asdict(split))


def read_view_split(path: Path | str) -> ViewSplit:
    """Read views.json. Raises: InputError: not readable, or not lists of names."""
    return read_record(path, ViewSplit, "make it again")
