"""What a job says: to its log file in full, to the terminal in short."""

import errno
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

    What a user can mend (bad input, a full disk, too little memory) ends the job with its text alone on the terminal;
    any other fault is passed on.
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
    except KeyboardInterrupt:
        logging.info("stopped on request")
        sys.exit(130)
    except MemoryError:
        logging.exception("out of memory: choose a smaller quality, or a machine with more")
        sys.exit(1)
    except OSError as error:
        logging.exception("%s", _told(error))
        sys.exit(1)
    except BaseException:
        logging.exception("failed")
        raise
    finally:
        logging.shutdown()


def _told(error: OSError) -> str:
    """The file, what is wrong with it, and what to do where that is plain."""
    text = f"{error.filename}: {error.strerror}" if error.filename and error.strerror else str(error)
    full = error.errno in (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)
    return f"{text}; free some space, then run the same again" if full else text


def progress(items, what: str, every: float = 5.0, total: int | None = None):
    """Iterate over `items`; every few seconds one line with the share done and the time left.

    A loop that ends within a second says nothing.
    """

    class Lines:
        def write(self, text: str) -> None:
            if text := text.strip():
                _log.info(text)

        def flush(self) -> None:
            pass

    bar = "{desc}: {n_fmt}/{total_fmt}, {elapsed} gone, about {remaining} left{postfix}"
    least = min(1.0, every)
    return tqdm(items, what, total, file=Lines(), mininterval=every, bar_format=bar, miniters=1, delay=least)
