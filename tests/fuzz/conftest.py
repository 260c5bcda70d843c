"""What the fuzz tests share, and the table of what they tried: to the file that FUZZ_TABLE names."""

import os
import zipfile
from pathlib import Path

import pytest
from fixtures import fuzzing
from fixtures.random_field import random_field

from dav_gswt.export import gswt


@pytest.fixture(scope="session", autouse=True)
def table():
    """Write the outcomes of all readers, as a table of Markdown."""
    yield
    if not (path := os.environ.get("FUZZ_TABLE")):
        return
    kinds = ("tried", "read", "refused")
    rows = [[name, *(outcomes[kind] for kind in kinds)] for name, outcomes in sorted(fuzzing.tried.items())]
    rows.append(["**all**", *(sum(row[k] for row in rows) for k in (1, 2, 3))])
    lines = ["| reader | tried | read | refused |", "|---|---:|---:|---:|"]
    lines += [f"| {' | '.join(map(str, row))} |" for row in rows]
    Path(path).write_text("\n".join(lines) + "\n", encoding="utf-8")


@pytest.fixture(scope="session")
def set_of_tiles(tmp_path_factory):
    """The entries of a gswt.zip."""
    path = tmp_path_factory.mktemp("set") / "gswt.zip"
    gswt.write_gswt([[random_field(4) for _ in range(16)]], 3.0, path)
    with zipfile.ZipFile(path) as archive:
        return {name: archive.read(name) for name in archive.namelist()}
