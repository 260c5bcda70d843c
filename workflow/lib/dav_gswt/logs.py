"""What a job says: to its log file in full, to the terminal in short."""

import logging
import sys
from contextlib import contextmanager

from tqdm import tqdm

from dav_gswt.errors import InputError

_log = logging.getLogger("dav_gswt")


class _Short(logging.Formatter):
    """The message alone: the traceback is in the log file, and Python prints it anyway."""

    def format(self, record: logging.LogRecord) -> str:
        return f"  {record.getMessage()}"


@contextmanager
def logging_to(path):
    """Send messages, warnings and the traceback of a script to `path`, and a short form to the terminal.

    An InputError ends the job with its own text and no traceback: it is meant for the user.
    """
    file = logging.FileHandler(path, mode="w", encoding="utf-8")
    file.setFormatter(logging.Formatter("%(asctime)s %(levelname)s %(message)s"))
    terminal = logging.StreamHandler(sys.stderr)
    terminal.setFormatter(_Short())
    logging.basicConfig(level=logging.INFO, handlers=[terminal, file], force=True)
    logging.captureWarnings(True)
    try:
        yield
    except InputError as error:
        logging.error("%s", error)
        sys.exit(1)
    except MemoryError:
        logging.exception("out of memory: choose a smaller quality, or a machine with more")
        raise
    except OSError as error:
        logging.exception("%s", f"{error.filename or 'a file'}: {error.strerror or error}")
        raise
    except BaseException:
        logging.exception("failed")
        raise
    finally:
        logging.shutdown()


def progress(items, what: str, every: float = 5.0, total: int | None = None):
    """Iterate over `items`; every few seconds one line with the share done and the time left."""

    class Lines:
        def write(self, text: str) -> None:
            if text := text.strip():
                _log.info(text)

        def flush(self) -> None:
            pass

    bar = "{desc}: {n_fmt}/{total_fmt}, {elapsed} gone, about {remaining} left{postfix}"
    return tqdm(items, desc=what, total=total, file=Lines(), mininterval=every, bar_format=bar, miniters=1)
