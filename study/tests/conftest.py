"""The study's tests: `make test-study`."""

import sys
from pathlib import Path

import pytest

HERE = Path(__file__).parent
sys.path[:0] = [str(HERE), str(HERE.parent)]
pytest_plugins = ["fixtures.session", "fixtures.workflow_runs"]


@pytest.fixture(scope="session")
def snakemake(root):
    """Call Snakemake with the study's Snakefile; returns the finished process with its output in stdout."""
    from fixtures.workflow_runs import call_of

    return call_of(root, "study/Snakefile")
