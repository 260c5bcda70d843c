"""A network file system that shows new files late: outputs of a job are hidden when it ends, and appear after a while.

Python imports this when it starts, where the folder is on PYTHONPATH. LATE_SECONDS: how late; LATE_RULES: of which
rules' jobs, separated by spaces (default: all).
"""

import atexit
import os
import re
import subprocess
import sys
from pathlib import Path

SHOW = """
import os, shutil, sys, time
time.sleep(float(sys.argv[1]))
for hidden, path in zip(sys.argv[2::2], sys.argv[3::2]):
    if os.path.isdir(os.path.dirname(path)) and not os.path.exists(path):
        os.rename(hidden, path)
    elif os.path.exists(hidden):  # made again meanwhile
        shutil.rmtree(hidden) if os.path.isdir(hidden) else os.remove(hidden)
"""


def hide_outputs() -> None:
    moved = []
    for path in map(Path.absolute, map(Path, sys.modules["__main__"].snakemake.output)):  # injected by Snakemake
        if path.exists():
            hidden = path.with_name(f".{path.name}.late{os.getpid()}")
            path.rename(hidden)
            moved += [hidden, path]
    command = [sys.executable, "-S", "-c", SHOW, os.environ["LATE_SECONDS"], *moved]
    subprocess.Popen(command, start_new_session=True, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL)


job = re.search(r"\.snakemake/scripts/\w+\.(\w+)\.py", " ".join(sys.orig_argv[:4]))
rules = os.environ.get("LATE_RULES", "").split()
if job and "LATE_SECONDS" in os.environ and (not rules or job[1] in rules):
    atexit.register(hide_outputs)
