"""Outputs that appear whole or not at all, JSON that says where it comes from, CSV tables, and digests."""

import csv
import hashlib
import json
import lzma
import math
import os
import shutil
import time
import tokenize
import zipfile
import zlib
from collections.abc import Iterable
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from typing import TypeVar

from pydantic import TypeAdapter, ValidationError

from dav_gswt.errors import InputError, summarize_error

Record = TypeVar("Record")

# where Snakefile, rules, scripts, config and page are: in the package of a wheel, or in the clone that it lies in
PIPELINE = Path(__file__).parent / "pipeline"
REPOSITORY = PIPELINE if PIPELINE.is_dir() else Path(__file__).parents[3]

# what reading a damaged archive, or arrays in one, may end in
UNREADABLE = (OSError, ValueError, ArithmeticError, TypeError, EOFError, LookupError, RuntimeError, SyntaxError)
UNREADABLE = (*UNREADABLE, tokenize.TokenError, lzma.LZMAError, zipfile.BadZipFile, zlib.error)
CLOCK_SKEW = 2.0  # seconds by which the clock of a file system may be ahead


@contextmanager
def atomic_file(path: Path | str):
    """A path beside `path` to write to; it takes `path`'s place when the block ends well, and goes when it does not.

    Raises: OSError: of the block or of writing, with `path` as its file name where it had none.
    """
    path = Path(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    part = path.with_name(f".{path.name}.part{path.suffix}")
    try:
        yield part
        with part.open("rb") as file:
            os.fsync(file.fileno())
        part.replace(path)
    except OSError as error:
        raise _name_error(error, path) from error
    finally:
        part.unlink(missing_ok=True)


def copy_file(source: Path | str, target: Path | str) -> None:
    """A file's bytes at another path, whole or not at all."""
    with atomic_file(target) as part:
        shutil.copyfile(source, part)


@contextmanager
def atomic_folder(path: Path | str):
    """A folder beside `path` to fill; it takes `path`'s place when the block ends well, and goes when it does not.

    What stood at `path` stays until then, also if the last step fails. A link stays one: the folder it leads to is
    replaced.
    """
    path = Path(path).resolve() if Path(path).is_symlink() else Path(path)
    part, old = path.with_name(f".{path.name}.part"), path.with_name(f".{path.name}.old")
    _restore_folder(path, part, old)  # after a run that was killed
    part.mkdir(parents=True)
    try:
        yield part
        if path.exists():
            path.rename(old)
        part.rename(path)
    except OSError as error:
        raise _name_error(error, path) from error
    finally:
        _restore_folder(path, part, old)


def _restore_folder(path: Path, part: Path, old: Path) -> None:
    if old.exists() and not path.exists():
        old.rename(path)
    for rest in (part, old):
        if rest.is_symlink():
            rest.unlink()
        shutil.rmtree(rest, ignore_errors=True)


def _name_error(error: OSError, path: Path) -> OSError:
    """The error with the name of what was to be written: a full disk is reported by calls that know no name."""
    if error.errno is None or error.filename not in (None, str(path)):
        return error
    return OSError(error.errno, error.strerror, str(path))


def write_json(path: Path | str, value) -> None:
    """Write JSON; NaN and infinity are refused, since JSON has neither."""
    text = json.dumps(value, indent=1, allow_nan=False) + "\n"
    with atomic_file(path) as part:
        part.write_text(text, encoding="utf-8")


def write_table(path: Path | str, rows: Iterable[dict]) -> None:
    """Write a CSV table: rows under the columns of the first one; no rows give an empty file.

    Floats have five significant digits; the field of a value that is not known is empty.
    Raises: ValueError: a row has a column that the first one lacks.
    """
    rows = list(rows)
    with atomic_file(path) as part, part.open("w", encoding="utf-8", newline="") as text:
        if rows:
            writer = csv.DictWriter(text, list(rows[0]), lineterminator="\n")
            writer.writeheader()
            writer.writerows({k: f"{v:.5g}" if isinstance(v, float) else v for k, v in row.items()} for row in rows)


def read_json(path: Path | str):
    """Read JSON. Raises: InputError: missing, malformed, or with a number that is not finite, by name."""
    try:
        text = Path(path).read_text(encoding="utf-8")
        return json.loads(text, parse_constant=_finite_number, parse_float=_finite_number, parse_int=_whole_number)
    except (OSError, ValueError, RecursionError) as error:
        raise InputError(f"{path}: not readable as JSON ({summarize_error(error)}); make or copy it again") from error


def _finite_number(text: str) -> float:
    """A number of JSON. Python's parser also reads NaN and Infinity, which JSON lacks, and 1e999 as infinite."""
    if not math.isfinite(value := float(text)):
        raise ValueError(f"{text} is no finite number")
    return value


def _whole_number(text: str) -> int:
    if len(text) > 300:
        raise ValueError(f"{text[:20]}... is too large a number")
    return int(text)


def read_record(path: Path | str, kind: type[Record], remedy: str) -> Record:
    """Read JSON as a dataclass. Raises: InputError: as `read_json`, or a value is missing or of another type."""
    values = read_json(path)
    try:
        return parse_record(values, kind)
    except ValueError as error:
        raise InputError(f"{path}: not as the workflow writes it ({summarize_error(error)}); {remedy}") from error


def parse_record(values, kind: type[Record]) -> Record:
    """A dataclass of values as JSON has them: whole numbers for `int`, no text for numbers.

    Raises: ValueError: a value is missing or of another type, by its key.
    """
    try:
        return _adapter(kind).validate_json(json.dumps(values), strict=True)
    except ValidationError as error:
        first = error.errors()[0]
        where = ".".join(map(str, first["loc"]))[:80]
        raise ValueError(": ".join(filter(None, (where, first["msg"])))) from None


_adapter = cache(TypeAdapter)


def require_file_name(name) -> str:
    """The name of a file that lies directly in a folder. Raises: ValueError: a path, or no name."""
    plain = isinstance(name, str) and name not in ("", ".", "..") and name.isprintable() and len(name.encode()) <= 255
    if not plain or {"/", "\\"} & set(name):
        raise ValueError(f"{str(name)[:80]!r} is no name of a file")
    return name


def locate_path(path: Path | str, repository: Path = REPOSITORY) -> Path:
    """Where a path of the config is: as it stands (~ is the home), or below the repository; else as it stands."""
    try:
        given = Path(path).expanduser()
    except RuntimeError:  # no user of that name: a file that begins with ~
        given = Path(path)
    return next((place for place in (given, repository / given) if place.exists()), given)


def is_from_future(path: Path | str) -> bool:
    """Whether a file is dated later than now: by another clock, or before this one was set back."""
    return Path(path).lstat().st_mtime > time.time() + CLOCK_SKEW


def digest_files(*paths: Path | str) -> str:
    """SHA-256 over the bytes of files, in the order given."""
    state = hashlib.sha256()
    for path in paths:
        with Path(path).open("rb") as file:
            hashlib.file_digest(file, lambda: state)
    return state.hexdigest()
