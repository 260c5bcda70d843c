"""Logging of a job: its log file has everything, the terminal warnings, errors and progress."""

import errno
import logging
import os
import sys
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TextIO, TypeVar

from tqdm import tqdm

from dav_gswt.errors import InputError

PROGRESS = "dav_gswt.progress"  # the logger of lines that say how far a job is

Item = TypeVar("Item")


class _MessageFormatter(logging.Formatter):
    """The message without a traceback: that is in the log file, and Python prints it anyway."""

    def format(self, record: logging.LogRecord) -> str:
        return f"  {record.getMessage()}"


@contextmanager
def logging_to(path):
    """Send all messages and the traceback of a script to `path`; to the terminal what one can act on, and progress.

    What libraries in C++ write to standard error is in the file alone. An error that a user can mend (bad input, a full
    disk, too little memory) ends the job with its message alone on the terminal; any other is raised again.
    """
    try:
        Path(path).write_bytes(b"")
    except OSError as error:  # a full disk, or one that is read-only: no log can say it
        print(f"  {describe_os_error(error)}", file=sys.stderr)
        sys.exit(1)
    with _native_messages_to(path) as stream:
        file = logging.FileHandler(path, encoding="utf-8")
        file.setFormatter(logging.Formatter("%(asctime)s %(levelname)s %(message)s"))
        terminal = logging.StreamHandler(stream)
        terminal.setFormatter(_MessageFormatter())
        terminal.addFilter(lambda record: record.levelno >= logging.WARNING or record.name == PROGRESS)
        shows_errors, logging.raiseExceptions = logging.raiseExceptions, False  # of writing the log, on a full disk
        logging.basicConfig(level=logging.INFO, handlers=[terminal, file], force=True)
        logging.captureWarnings(True)
        try:
            yield
        except InputError as error:
            logging.error("%s", error)
            sys.exit(1)
        except KeyboardInterrupt:
            logging.warning("stopped on request")
            sys.exit(130)
        except MemoryError:
            logging.exception("out of memory: choose a smaller preset, or a machine with more")
            sys.exit(1)
        except OSError as error:
            logging.exception("%s", describe_os_error(error))
            sys.exit(1)
        except BaseException:
            logging.exception("failed")
            raise
        finally:
            logging.shutdown()
            logging.raiseExceptions = shows_errors


@contextmanager
def _native_messages_to(path: Path | str) -> Iterator[TextIO]:
    """Let what libraries in C++ write to standard error go to a log file: the last words of one that aborts.

    Yields the stream for messages of Python: standard error as it was before.
    """
    sys.stderr.flush()
    before, stream = os.dup(2), sys.stderr
    log = os.open(path, os.O_WRONLY | os.O_APPEND)
    os.dup2(log, 2)
    os.close(log)
    sys.stderr = os.fdopen(os.dup(before), "w", buffering=1, encoding=stream.encoding, errors=stream.errors)
    try:
        yield sys.stderr
    finally:
        sys.stderr.flush()  # not closed: handlers of the root logger keep it
        sys.stderr = stream
        os.dup2(before, 2)
        os.close(before)


def describe_os_error(error: OSError) -> str:
    """The file, what is wrong with it, and the remedy for a full disk."""
    text = f"{error.filename}: {error.strerror}" if error.filename and error.strerror else str(error)
    full = error.errno in (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)
    return f"{text}; free some space, then run the same again" if full else text


def progress(items: Iterable[Item], what: str, every: float = 30.0) -> "tqdm[Item]":
    """Iterate over `items`; every half a minute one line with the share done and the time left.

    A loop that ends within a second logs nothing.
    """

    class Lines:
        def write(self, text: str) -> None:
            if text := text.strip():
                logging.getLogger(PROGRESS).info(text)

        def flush(self) -> None:
            pass

    bar = "{desc}: {n_fmt}/{total_fmt}, {elapsed} gone, about {remaining} left{postfix}"
    least = min(1.0, every)
    return tqdm(items, what, file=Lines(), mininterval=every, bar_format=bar, miniters=1, delay=least)
