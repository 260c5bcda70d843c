"""The Slurm profile on a real Slurm of one node: the bytes of the local run, and what happens to cells that fail."""

import csv
import re
import shutil
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

import pytest
from fixtures.runs import TINY, USUAL
from fixtures.slurm_node import NotStarted, slurm

from dav_gswt.files import digest_files, read_json, write_json

pytestmark = pytest.mark.slow
COARSE = "results/desert/seed{}/draft/coarse"
FEW = "rounds: 1\nsweeps: {k: [1, 2]}"
TABLE = "results/sweeps/k.csv"
# Beside the profile what this Slurm lacks (accounts, a database), and less time between two looks at the queue.
SLURM = ["--profile", "workflow/profiles/slurm", "--slurm-status-command", "squeue", "--slurm-no-account"]
SLURM += ["--slurm-init-seconds-before-status-checks", "4"]


@dataclass(frozen=True)
class Sweep:
    """Two cells from a scene's photos on: seed 0 as in the local run, and seed 1 with a photo that is not there."""

    folder: Path
    status: int
    out: str

    def memory(self, rule: str, seed: int) -> list[int]:
        """What each attempt of a cell's job asked for, in MB."""
        return [
            int(re.search(r"mem_mb=(\d+)", block)[1])
            for block in re.findall(rf"^rule {rule}:\n(.+?resources: .+?)$", self.out, re.M | re.S)
            if f"scene=desert, seed={seed}," in block
        ]


@pytest.fixture(scope="module")
def cluster(tmp_path_factory):
    """The environment in which Slurm's commands work."""
    try:
        with slurm(tmp_path_factory.mktemp("slurm")) as environment:
            yield environment
    except NotStarted as reason:
        pytest.skip(str(reason))


@pytest.fixture(scope="module")
def submitted(cluster):
    """Call Snakemake with the profile, in a copy of the repository; returns the finished process, output in stdout."""

    def call(folder, *arguments):
        command = [sys.executable, "-m", "snakemake", *SLURM, "--configfile", USUAL, TINY, *arguments]
        return subprocess.run(
            command,
            cwd=folder,
            env=cluster,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            check=False,
            timeout=600,  # a job that Slurm forgot would be waited for
        )

    return call


@pytest.fixture(scope="module")
def sweep(submitted, tiny, checkout, tmp_path_factory) -> Sweep:
    folder = checkout(tmp_path_factory.mktemp("sweep"))
    photos = folder / tiny.photos.relative_to(tiny.folder)
    shutil.copytree(tiny.photos, photos)
    views = read_json(tiny.start / "views.json")
    for seed, start in ((0, views["start"]), (1, ["lost.png", *views["start"][1:]])):
        (photos.parent / f"seed{seed}").mkdir()
        write_json(photos.parent / f"seed{seed}/views.json", views | {"start": start})
    targets = [f"{COARSE.format(seed)}/metrics.json" for seed in (1, 0)]
    # at first too little for Python alone
    done = submitted(folder, "--set-resources", "fit_coarse:mem_mb=50*attempt**6", "--", *targets)
    return Sweep(folder, done.returncode, done.stdout)


def test_a_cluster_makes_the_bytes_of_the_local_run(sweep, tiny):
    made = sweep.folder / COARSE.format(0)
    assert made.is_dir(), sweep.out
    for name in ("field.ply", "ground.exr", "fit.json", "metrics.json"):
        assert digest_files(made / name) == digest_files(tiny.coarse / name), name


def test_a_job_that_runs_out_of_memory_is_submitted_again_with_more(sweep):
    assert sweep.memory("fit_coarse", 0) == [50, 3200], sweep.out
    first = re.search(r"jobid (\d+) \(log: (.+?/rule_fit_coarse/.+?)\)", sweep.out)
    assert "xceeded job memory limit" in Path(first[2]).read_text()


def test_a_cell_that_fails_is_tried_again_and_stops_no_other(sweep):
    assert sweep.status == 1 and sweep.memory("fit_coarse", 1) == [50, 3200, 36450], sweep.out
    assert not (sweep.folder / COARSE.format(1)).exists()
    assert (sweep.folder / COARSE.format(0) / "metrics.json").is_file()
    assert "lost.png" in (sweep.folder / "results/logs/desert/seed1/draft/coarse/fit_coarse.log").read_text()


def test_a_sweep_has_the_numbers_of_the_local_run(submitted, snakemake, tiny, checkout, tmp_path):
    (few := tmp_path / "few.yaml").write_text(FEW)
    here = shutil.copytree(tiny.folder, tmp_path / "here", symlinks=True)
    snakemake(here, "--cores", "2", TABLE, configs=(USUAL, TINY, few))
    there = checkout(tmp_path / "there")
    for known in (tiny.photos, tiny.start / "views.json", tiny.coarse):
        copy = shutil.copytree if known.is_dir() else shutil.copy2
        (place := there / known.relative_to(tiny.folder)).parent.mkdir(parents=True, exist_ok=True)
        copy(known, place)
    done = submitted(there, few, "--", TABLE)
    assert done.returncode == 0, done.stdout
    assert "rule update_field" in done.stdout and "rule fit_coarse" not in done.stdout
    rows = [_numbers(folder / TABLE) for folder in (here, there)]
    assert rows[0] == rows[1] and [row["k"] for row in rows[1]] == ["1", "2"]


def _numbers(path: Path) -> list[dict]:
    """A sweep's rows but for what jobs cost."""
    with path.open(newline="") as file:
        rows = list(csv.DictReader(file))
    return [{key: row[key] for key in row if not key.endswith("_s") and key != "peak_mb"} for row in rows]
