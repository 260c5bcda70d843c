"""Outputs that appear whole or not at all, JSON that says where it comes from, and digests."""

import hashlib
import json
import lzma
import os
import shutil
import tokenize
import zipfile
import zlib
from contextlib import contextmanager
from pathlib import Path

from dav_gswt.errors import InputError

UNREADABLE = (  # what reading a damaged archive, or arrays in one, may end in
    OSError,
    ValueError,
    TypeError,
    EOFError,
    LookupError,
    RuntimeError,
    SyntaxError,
    tokenize.TokenError,
    lzma.LZMAError,
    zipfile.BadZipFile,
    zlib.error,
)


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
        raise _named(error, path) from error
    finally:
        part.unlink(missing_ok=True)


def copy_file(source: Path | str, target: Path | str) -> None:
    """A file's bytes at another path, whole or not at all."""
    with atomic_file(target) as part:
        shutil.copyfile(source, part)


@contextmanager
def atomic_folder(path: Path | str):
    """A folder beside `path` to fill; it takes `path`'s place when the block ends well, and goes when it does not.

    What stood at `path` stays until then, also if the last step fails.
    """
    path = Path(path)
    part, old = path.with_name(f".{path.name}.part"), path.with_name(f".{path.name}.old")
    _settle(path, part, old)  # after a run that was killed
    part.mkdir(parents=True)
    try:
        yield part
        if path.exists():
            path.rename(old)
        part.rename(path)
    except OSError as error:
        raise _named(error, path) from error
    finally:
        _settle(path, part, old)


def _settle(path: Path, part: Path, old: Path) -> None:
    if old.exists() and not path.exists():
        old.rename(path)
    for rest in (part, old):
        shutil.rmtree(rest, ignore_errors=True)


def _named(error: OSError, path: Path) -> OSError:
    """The error with the name of what was to be written: a full disk is reported by calls that know no name."""
    if error.errno is None or error.filename not in (None, str(path)):
        return error
    return OSError(error.errno, error.strerror, str(path))


def write_json(path: Path | str, value) -> None:
    """Write JSON; NaN and infinity are refused, since JSON has neither."""
    text = json.dumps(value, indent=1, allow_nan=False) + "\n"
    with atomic_file(path) as part:
        part.write_text(text, encoding="utf-8")


def read_json(path: Path | str):
    """Read JSON. Raises: InputError: missing or malformed, by name."""
    try:
        return json.loads(Path(path).read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise InputError(f"{path}: not readable as JSON ({error})") from error


def digest_files(*paths: Path | str) -> str:
    """SHA-256 over the bytes of files, in the order given."""
    state = hashlib.sha256()
    for path in paths:
        with Path(path).open("rb") as file:
            while block := file.read(1 << 20):
                state.update(block)
    return state.hexdigest()
