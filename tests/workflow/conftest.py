"""Snakemake as a user calls it: plans (dry runs) in empty folders, and real runs of the smallest experiment."""

import os
import re
import shutil
import subprocess
import sys
from collections import Counter
from collections.abc import Callable
from pathlib import Path

import pytest
from fixtures.runs import TINY, USUAL, Made
from fixtures.snakemake_calls import call_snakemake

COPIED = ["Snakefile", "rules", "scripts", "config", "profiles"]  # the last is a link
COPIED += [f"workflow/{name}" for name in ("profiles", "report", "schemas", "viewer", "forced_choice", "logger")]


@pytest.fixture(scope="session")
def snakemake(root):
    """Call Snakemake in a folder; returns the finished process with its output in stdout."""

    def call(folder, *arguments, configs=(USUAL,), check=True, env=None):
        words = ["--snakefile", root / "Snakefile", "--directory", folder, *arguments, "--configfile"]
        done = call_snakemake([*words, *(root / c for c in configs)], root, env)
        assert not check or done.returncode == 0, done.stdout
        return done

    return call


@pytest.fixture(scope="session")
def planned(snakemake):
    """Count, per rule, the jobs that Snakemake would run in a folder."""

    def plan(folder, *arguments, **options):
        done = snakemake(folder, *arguments, "--dry-run", "--quiet", "rules", **options)
        table = re.search(r"^job +count\n[- ]+\n(.+?)^total", done.stdout, re.M | re.S)
        assert table or "Nothing to be done" in done.stdout, done.stdout
        rows = table[1].splitlines() if table else []
        return Counter({rule: int(n) for rule, n in map(str.split, rows)})

    return plan


@pytest.fixture(scope="session")
def tiny(snakemake, tmp_path_factory) -> Made:
    """All stages of the smallest desert, run once for all tests; they leave it as it is."""
    folder = tmp_path_factory.mktemp("tiny")
    done = snakemake(folder, "--cores", "2", configs=(USUAL, TINY))
    return Made(folder, "desert", "seed0/draft", "active_farthest_none_pdrop0_lam0_k2/iter1", done.stdout)


@pytest.fixture(scope="session")
def finished(snakemake, tiny, tmp_path_factory) -> Made:
    """A finished field as a scene: the field that the desert ended with, as if it came from elsewhere."""
    folder = tmp_path_factory.mktemp("finished")
    shutil.copy(tiny.round / "field.ply", folder / "finished.ply")
    done = snakemake(folder, "--cores", "2", "--config", "scene=finished", configs=(USUAL, TINY))
    return Made(folder, "finished", "seed0/draft", "active_external_none_pdrop0_lam0_k0/iter0", done.stdout)


@pytest.fixture(scope="session")
def beach(snakemake, photo_sets, tmp_path_factory) -> Made:
    """Real photos of a beach, reduced: all stages, with little work in each."""
    folder = tmp_path_factory.mktemp("beach")
    (folder / "beach.yaml").write_text(f"""
scene: beach
scenes:
  beach:
    kind: photos
    folder: {photo_sets}/brighton_beach/images
    size: 512
    start: 8
    agent: replay
    preset: reduced
    tiling: semantic
presets:
  reduced: {{size: 256, spacing: 1.5, max_gaussians: 40000, steps: 80, steps_per_photo: 5, level_steps: 10}}
""")
    done = snakemake(folder, "--cores", "2", configs=(USUAL, TINY, folder / "beach.yaml"))
    return Made(folder, "beach", "seed0/reduced", "active_farthest_none_pdrop0_lam0_k2/iter1", done.stdout)


@pytest.fixture(scope="session")
def checkout(root) -> Callable[[Path], Path]:
    """Copy what of the repository a run needs into a folder, so that `dav_gswt.cli.run` works there as in a clone."""

    def copy(folder: Path) -> Path:
        for name in COPIED:
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            if (root / name).is_dir() and not (root / name).is_symlink():
                shutil.copytree(root / name, folder / name)
            else:
                shutil.copy(root / name, folder / name, follow_symlinks=False)
        return folder

    return copy


@pytest.fixture(scope="session")
def run():
    """Call what `make run` calls in a copy of the repository; returns the finished process, its output in stdout."""

    def call(folder, *arguments, env=None):
        command = [sys.executable, "-m", "dav_gswt.cli.run", *arguments]
        return subprocess.run(
            command,
            cwd=folder,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            check=False,
            env=os.environ | (env or {}),
        )

    return call
