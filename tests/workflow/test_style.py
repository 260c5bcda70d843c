"""Rules and code as snakemake's lint and the formatters want them."""

import subprocess
import sys

import pytest


def test_the_workflow_is_lint_clean_but_for_its_environment(snakemake, tmp_path):
    """One pip environment serves all rules, so lint's wish for a conda or container directive a rule is not met."""
    done = snakemake(tmp_path, "--lint", check=False)
    wishes = [line.strip() for line in done.stdout.splitlines() if line.strip().startswith("* ")]
    assert not [wish for wish in wishes if "No conda/container" not in wish and "environment" not in wish], done.stdout


@pytest.mark.parametrize(
    "tool",
    [
        pytest.param(["ruff", "check", "."], id="ruff check"),
        pytest.param(["ruff", "format", "--check", "."], id="ruff format"),
        pytest.param(["snakefmt", "--check", "Snakefile", "rules"], id="snakefmt"),
    ],
)
def test_the_code_is_formatted(root, tool):
    done = subprocess.run([sys.executable, "-m", *tool], cwd=root, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
