"""The key reference and the schema are those of the models."""

import pytest

from dav_gswt.study.config_reference import make_reference


@pytest.mark.parametrize("name", make_reference())
def test_the_reference_is_that_of_the_models(root, name):
    assert (root / name).read_text() == make_reference()[name], "run `make reference`"


def test_every_key_has_a_sentence():
    rows = [line for line in make_reference()["docs/reference/config.md"].splitlines() if line.startswith("| `")]
    keys = {row.split("|")[1].strip() for row in rows if not row.split("|")[2].strip()}
    assert keys <= {"`kind`", "`model`"}  # which tell kinds of tables apart
