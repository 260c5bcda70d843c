"""The profiles are found and read, and ask for what their comments say; what of Snakemake is no public API."""

import inspect
import re
import subprocess
import sys
from types import SimpleNamespace

import pytest
import yaml
from fixtures.runs import TINY, USUAL
from snakemake.scheduling import job_scheduler
from snakemake.settings.types import MaxJobsPerTimespan

from dav_gswt.cli import run as make_run
from dav_gswt.workflow import lift_job_rate_limit

PROFILES = "workflow/profiles"
ROUND = "results/desert/seed0/draft/active_farthest_none_pdrop0_lam0_k2/iter{t}"


@pytest.fixture
def read_as():
    """What Snakemake makes of a command line, profiles included, in the folder where it is typed."""
    parse_args = pytest.importorskip("snakemake.cli").parse_args
    return lambda *arguments: parse_args(list(arguments))[1]


@pytest.fixture
def clone(checkout, tmp_path, monkeypatch):
    monkeypatch.delenv("SNAKEMAKE_PROFILE", raising=False)
    monkeypatch.chdir(checkout(tmp_path / "clone"))


@pytest.fixture
def asked(snakemake, root, tmp_path):
    """Per rule, the resources that a plan's jobs ask for at an attempt, under the profiles that are named."""

    def call(attempt, *targets, profiles=("slurm",), study="rounds: 1"):
        (tmp_path / "study.yaml").write_text(study)
        named = [f"--profile={root / PROFILES / name}" for name in profiles]
        arguments = [*named, "--dry-run", f"--attempt={attempt}", *targets]
        out = snakemake(tmp_path, *arguments, configs=(USUAL, TINY, tmp_path / "study.yaml")).stdout
        jobs = re.findall(r"^ *(?:local)?rule (\w+):\n(?: .+\n)*? +resources: (.+)$", out, re.M)
        return {rule: dict(item.split("=", 1) for item in said.split(", ")) for rule, said in jobs}

    return call


def test_plain_snakemake_reads_the_default_profile(clone, read_as):
    args = read_as("--cores", "2")
    assert args.scheduler == "greedy" and args.rerun_incomplete and len(args.rerun_triggers) == 4
    assert read_as("--cores", "2", "--workflow-profile", "none").scheduler != "greedy"


def test_make_run_reads_the_default_profile(clone, read_as, monkeypatch):
    commands = []
    monkeypatch.setattr(make_run, "follow", lambda command, root: commands.append(command) or (1, 0))
    assert make_run.main(["--cores", "2"]) == 1
    words = commands[0][commands[0].index("snakemake") + 1 :]
    args = read_as(*(word for word in words if word not in ("--logger", "davgswt")))  # a plugin, found by PYTHONPATH
    assert args.scheduler == "greedy" and args.rerun_incomplete


def test_a_cluster_adds_to_the_default_profile(clone, read_as):
    args = read_as(f"--profile={PROFILES}/slurm", f"--profile={PROFILES}/gpu")
    assert args.executor == "slurm" and args.keep_going and args.retries == 2
    assert args.scheduler == "greedy" and args.rerun_incomplete


@pytest.mark.slow
def test_every_further_attempt_asks_for_more(asked):
    """Of rules that state what they need, and of those that leave it to the profile."""
    targets = ["all"]
    first, second = (asked(n, *targets, study="rounds: 1") for n in (1, 2))
    assert len(first) > 12 and first["fit_coarse"] != first["select_poses"]
    work = set(first) - {"all"}
    for rule in work:
        for key in ("mem_mb", "runtime"):
            assert int(second[rule][key]) == 2 * int(first[rule][key]) > 0, (rule, key)
    assert (first["fit_coarse"]["mem_mb"], second["fit_coarse"]["runtime"]) == ("2000", "120")


@pytest.mark.slow
def test_a_gpu_is_asked_for_by_rules_that_are_there(asked, root):
    named = yaml.safe_load((root / PROFILES / "gpu/config.yaml").read_text())["set-resources"]
    there = re.findall(r"^rule (\w+):", "".join(p.read_text() for p in (root / "rules").rglob("*.smk")), re.M)
    assert set(named) <= set(there)
    jobs = asked(1, profiles=("slurm", "gpu"))
    assert {rule for rule, needs in jobs.items() if needs.get("gpu") == "1"} == set(named) & set(jobs) != set()
    assert jobs["fit_coarse"]["mem_mb"] == "2000"


@pytest.mark.slow
def test_a_round_is_one_submission(snakemake, root, tmp_path):
    """Of its own: two rounds in one job would wait for the scoring between them, which waits for the first."""
    target = ROUND.format(t=2) + "/field.ply"
    arguments = [f"--profile={root / PROFILES}/slurm", "--dry-run", target]
    out = snakemake(tmp_path, *arguments, configs=(USUAL, TINY)).stdout
    groups = re.findall(r"Group job (\S+) .+?:\n(.+?)(?=^\S)", out, re.M | re.S)
    assert [name[-1] for name, _ in groups] == ["1", "2"]
    for _, jobs in groups:
        assert sorted(re.findall(r"^ +rule (\w+):", jobs, re.M)) == ["capture_views", "select_poses", "update_field"]


@pytest.mark.slow
def test_who_asks_people_or_devices_stays_here_and_asks_once(checkout, tmp_path):
    """On a cluster, too. All that the rule reads is empty, so it fails; the profile would have it tried twice more."""
    photos, capture = "results/mine/photos", ROUND.format(t=1).replace("desert", "mine") + "/capture"
    folder = checkout(tmp_path / "clone")
    scene = "kind: photos, folder: mine, size: 64, start: 3, agent: handheld, preset: draft, tiling: semantic"
    (folder / "mine.yaml").write_text(f"scenes: {{mine: {{{scene}}}}}")
    for place in ("mine", f"{photos}/images", f"{photos}/sparse"):
        (folder / place).mkdir(parents=True)
    read = [f"{photos}/lenses.json", f"{photos}/ground.json", "results/mine/seed0/views.json"]
    read += ["results/mine/seed0/draft/coarse/field.ply", capture.replace("capture", "poses.json")]
    for place in read:
        (folder / place).parent.mkdir(parents=True, exist_ok=True)
        (folder / place).touch()
    command = [sys.executable, "-m", "snakemake", "--profile", f"{PROFILES}/slurm"]
    command += ["--configfile", USUAL, TINY, "mine.yaml", "--", capture]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    assert done.returncode == 1 and "localrule request_views" in done.stderr, done.stderr
    assert done.stderr.count("Error in rule request_views") == 1 and "Trying to restart" not in done.stderr


def scheduler(limit: str) -> SimpleNamespace:
    return SimpleNamespace(job_rate_limiter=job_scheduler.JobRateLimiter(MaxJobsPerTimespan.parse_choice(limit)))


def test_the_scheduler_has_a_limiter_of_this_name():
    assert "self.job_rate_limiter" in inspect.getsource(job_scheduler.JobScheduler.__init__)


def test_the_default_limit_is_lifted():
    lifted = scheduler("100/1s")
    lift_job_rate_limit(lifted)
    assert lifted.job_rate_limiter is None


def test_a_limit_that_the_user_gave_stays():
    kept = scheduler("10/1s")
    lift_job_rate_limit(kept)
    assert kept.job_rate_limiter.max_jobs == 10
