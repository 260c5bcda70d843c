"""Provenance: a digest an input, of files, folders and lists of both."""

import pytest

from dav_gswt.files import digest_files
from dav_gswt.provenance import record_provenance


@pytest.fixture
def photos(tmp_path):
    for name in ("b.png", "a.png", ".hidden"):
        (tmp_path / name).write_text(name)
    return tmp_path


def told(*given):
    return record_provenance({"photos": given[0] if len(given) == 1 else list(given)}, {})["inputs"]["photos"]


def test_a_folder_is_its_files_by_name(photos):
    assert told(photos) == digest_files(photos / "a.png", photos / "b.png")
    assert told(photos / "a.png") == digest_files(photos / "a.png")
    assert told(photos / "b.png", photos) == digest_files(*(photos / f"{n}.png" for n in "bab"))


def test_every_photo_counts(photos):
    before = told(photos)
    (photos / "b.png").write_text("another")
    assert told(photos) != before
