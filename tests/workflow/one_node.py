"""Slurm on this machine alone, in a folder of its own: what a cluster does with a profile, without a cluster."""

import getpass
import os
import shutil
import socket
import subprocess
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

PROGRAMS = ("munged", "slurmctld", "slurmd", "sinfo", "sbatch", "srun", "squeue")
# It counts no real processors and no real memory, so that the jobs of any machine fit; it kills who takes more memory
# than was asked for, by looking every second, which needs no control groups.
CONF = """
ClusterName=one
SlurmctldHost={host}(127.0.0.1)
SlurmctldPort={ports[0]}
SlurmdPort={ports[1]}
SlurmUser={user}
SlurmdUser={user}
AuthType=auth/munge
AuthInfo=socket={folder}/munge.socket
StateSaveLocation={folder}/state
SlurmdSpoolDir={folder}/spool
SlurmctldPidFile={folder}/slurmctld.pid
SlurmdPidFile={folder}/slurmd.pid
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU_Memory
SlurmdParameters=config_overrides
JobAcctGatherType=jobacct_gather/linux
JobAcctGatherFrequency=task=1
JobAcctGatherParams=OverMemoryKill
KillWait=1
NodeName={host} NodeAddr=127.0.0.1 CPUs=4 RealMemory=100000
PartitionName=all Nodes=ALL Default=YES MaxTime=INFINITE State=UP
"""


class NotStarted(Exception):
    """Slurm is not there or does not start here; the message says why."""


@contextmanager
def slurm(folder: Path) -> Iterator[dict[str, str]]:
    """Start Slurm; yields the environment in which its commands find it. Nothing outside the folder is touched.

    Raises: NotStarted.
    """
    places = os.environ["PATH"] + ":/usr/sbin:/sbin"
    found = {program: shutil.which(program, path=places) for program in PROGRAMS}
    if missing := [program for program, path in found.items() if not path]:
        raise NotStarted(f"no {', '.join(missing)} on this machine: apt-get install slurm-wlm munge")
    environment = os.environ | prepared(folder, found["srun"], places)
    munge = {"key-file": "key", "socket": "socket", "pid-file": "pid", "seed-file": "seed", "log-file": "log"}
    daemons = {
        "munged": ["--foreground", "--force", *(f"--{k}={folder}/munge.{name}" for k, name in munge.items())],
        "slurmctld": ["-D", "-i"],
        "slurmd": ["-D"],
    }
    with ExitStack() as stack:
        for name, options in daemons.items():
            out = stack.enter_context((folder / f"{name}.log").open("w"))
            daemon = subprocess.Popen([found[name], *options], env=environment, stdout=out, stderr=out)
            stack.callback(ended, daemon)
            if name == "munged":
                awaited(lambda: (folder / "munge.socket").exists(), folder / "munged.log")
        awaited(lambda: "idle" in said("sinfo", "--noheader", "--format=%T", env=environment), folder / "slurmd.log")
        yield environment


def prepared(folder: Path, srun: str, places: str) -> dict[str, str]:
    """Write the key, the configuration and what else it needs; returns what is to be set in the environment.

    Snakemake's plugin takes every SLURM_* out of the environment of a job's srun, SLURM_CONF as well: one that is found
    before the real srun sets it again.
    """
    for name in ("state", "spool", "bin"):
        (folder / name).mkdir()
    (folder / "munge.key").write_bytes(os.urandom(1024))
    (folder / "munge.key").chmod(0o400)
    conf = folder / "slurm.conf"
    conf.write_text(
        CONF.format(host=socket.gethostname().split(".")[0], ports=ports(2), user=getpass.getuser(), folder=folder)
    )
    shim = folder / "bin/srun"
    shim.write_text(f'#!/bin/sh\nSLURM_CONF={conf} exec {srun} "$@"\n')
    shim.chmod(0o755)
    return {"SLURM_CONF": str(conf), "PATH": f"{folder}/bin:{places}"}


def ports(count: int) -> list[int]:
    """Ports that nobody listens on."""
    with ExitStack() as stack:
        sockets = [stack.enter_context(socket.socket()) for _ in range(count)]
        for one in sockets:
            one.bind(("127.0.0.1", 0))
        return [one.getsockname()[1] for one in sockets]


def awaited(ready, log: Path, seconds: float = 20.0) -> None:
    """Wait until something is so. Raises: NotStarted, with the end of the log, when it is not in time."""
    end = time.monotonic() + seconds
    while not ready():
        if time.monotonic() > end:
            raise NotStarted(f"Slurm does not start here; {log.name} ends with: {log.read_text()[-300:]}")
        time.sleep(0.1)


def said(*command: str, env: dict[str, str]) -> str:
    """What a command prints, whether it fails or not."""
    return subprocess.run(command, env=env, capture_output=True, text=True, check=False).stdout


def ended(daemon: subprocess.Popen) -> None:
    daemon.terminate()
    try:
        daemon.wait(10)
    except subprocess.TimeoutExpired:
        daemon.kill()
        daemon.wait()
