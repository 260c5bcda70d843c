"""One run at a time in a folder, and files that are dated in the future."""

import os
import subprocess
import sys
import time

import pytest

from dav_gswt.cli.working_folder import LOCK, hold_folder, redate_files
from dav_gswt.errors import InputError

HOLD = "import sys, pathlib\nfrom dav_gswt.cli.working_folder import hold_folder\n"
HOLD += "with hold_folder(pathlib.Path(sys.argv[1])):\n    print(flush=True)\n    input()"


@pytest.fixture
def holder(tmp_path):
    """A process that holds a folder."""
    with subprocess.Popen(
        [sys.executable, "-c", HOLD, tmp_path], stdin=subprocess.PIPE, stdout=subprocess.PIPE
    ) as process:
        process.stdout.readline()
        yield process
        process.kill()


def test_a_folder_is_held_by_one_process_which_is_named(holder, tmp_path):
    said = rf"another run works in this folder \(process {holder.pid}\)"
    with pytest.raises(InputError, match=said), hold_folder(tmp_path):
        pass


def test_a_killed_process_holds_nothing(holder, tmp_path):
    holder.kill()
    holder.wait()
    with hold_folder(tmp_path):
        assert (tmp_path / LOCK).read_text() == str(os.getpid())


def test_a_folder_can_be_held_again(tmp_path):
    for _ in range(2):
        with hold_folder(tmp_path):
            pass


def test_files_from_the_future_are_dated_now(tmp_path):
    paths = [tmp_path / "old", tmp_path / "ahead", tmp_path / "folder/.hidden"]
    paths[2].parent.mkdir()
    for path, age in zip(paths, (-60, 3600, 86400), strict=True):
        path.write_text("")
        os.utime(path, (0, time.time() + age))
    os.utime(paths[2].parent, (0, time.time() + 3600))
    old = paths[0].stat().st_mtime
    assert redate_files(tmp_path) == 2
    assert paths[0].stat().st_mtime == old
    assert max(path.stat().st_mtime for path in tmp_path.rglob("*")) <= time.time()


def test_without_results_there_is_nothing_to_date(tmp_path):
    assert redate_files(tmp_path / "results") == 0
