"""The folder that a run works in: for one run at a time, and without files from the future."""

import fcntl
import os
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TextIO

import psutil

from dav_gswt.errors import InputError
from dav_gswt.files import is_from_future

LOCK = ".snakemake/run.lock"


@contextmanager
def hold_folder(folder: Path) -> Iterator[None]:
    """Keep other runs out of a folder. The system lets go of it when this process ends, in whatever way.

    Snakemake has locks of its own, but a run takes those of a killed one away, and two that begin at the same moment
    would take each other's.

    Raises: InputError: another run works there.
    """
    path = folder / LOCK
    path.parent.mkdir(exist_ok=True)
    with path.open("a+", encoding="utf-8") as file:
        _lock(file)
        file.truncate(0)
        file.write(str(os.getpid()))
        file.flush()
        yield


def _lock(file: TextIO) -> None:
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        file.seek(0)
        number = file.read().strip() or "unknown"
        raise InputError(f"another run works in this folder (process {number}): wait for it or stop it") from None
    except OSError:
        pass  # a file system without locks: Snakemake's have to do


def find_running_processes() -> list[int]:
    """Processes that work in this folder: Snakemake, or a job that outlived it."""
    here, found = Path.cwd(), []
    for process in psutil.process_iter():
        try:
            words = process.cmdline()[:4]
            works = any(word.endswith("snakemake") or ".snakemake/scripts/" in word for word in words)
            if works and Path(process.cwd()) == here:
                found.append(process.pid)
        except (psutil.Error, OSError):
            continue
    return found


def redate_files(folder: Path) -> int:
    """Date what lies in the future as of now. Returns how many files there were.

    They are there after the clock was set back. Snakemake would refuse each new file as older than its inputs.
    """
    now, count = time.time(), 0
    for path in [folder, *folder.rglob("*")] if folder.is_dir() else []:
        if is_from_future(path):
            os.utime(path, (now, now), follow_symlinks=False)
            count += not path.is_dir()
    return count
