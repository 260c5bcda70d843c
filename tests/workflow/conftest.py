"""Snakemake as a user calls it: plans (dry runs) in empty folders, and real runs of the smallest experiment."""

import re
import subprocess
import sys
from collections import Counter

import pytest


@pytest.fixture(scope="session")
def snakemake(root):
    """Call Snakemake in a folder; returns the finished process with its output in stdout."""

    def call(folder, *arguments, configs=("config/config.yaml",), check=True):
        command = [sys.executable, "-m", "snakemake", "--snakefile", root / "Snakefile", "--directory", folder]
        command += [*arguments, "--configfile", *(root / c for c in configs)]
        done = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, check=False)
        assert not check or done.returncode == 0, done.stdout
        return done

    return call


@pytest.fixture(scope="session")
def planned(snakemake):
    """Count, per rule, the jobs that Snakemake would run in a folder."""

    def plan(folder, *arguments, **options):
        done = snakemake(folder, *arguments, "--dry-run", "--quiet", "rules", **options)
        table = re.search(r"^job +count\n[- ]+\n(.+?)^total", done.stdout, re.M | re.S)
        rows = table[1].splitlines() if table else []
        return Counter({rule: int(n) for rule, n in map(str.split, rows)})

    return plan
