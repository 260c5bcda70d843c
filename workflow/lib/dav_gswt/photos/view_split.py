"""views.json: which photos start, which may be asked for, and which only test."""

from dataclasses import asdict, dataclass
from pathlib import Path

from pydantic import TypeAdapter, ValidationError

from dav_gswt.errors import InputError
from dav_gswt.files import read_json, write_json


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
    try:
        return TypeAdapter(ViewSplit).validate_python(read_json(path))
    except ValidationError as error:
        first = error.errors()[0]
        problem = f"{'.'.join(map(str, first['loc']))}: {first['msg']}"
        raise InputError(f"{path}: not as the workflow writes it ({problem}); make it again") from error
