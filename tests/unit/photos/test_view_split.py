"""views.json: what is written is read back, and what is wrong in it is named."""

import pytest

from dav_gswt.errors import InputError
from dav_gswt.files import read_json, write_json
from dav_gswt.photos.view_split import ViewSplit, read_view_split, write_view_split

SPLIT = ViewSplit(start=("a.png", "b.png"), pool=(), test=("c.png",))


def test_what_is_written_is_read_back(tmp_path):
    write_view_split(tmp_path / "views.json", SPLIT)
    assert read_view_split(tmp_path / "views.json") == SPLIT
    assert read_json(tmp_path / "views.json") == {"start": ["a.png", "b.png"], "pool": [], "test": ["c.png"]}


@pytest.mark.parametrize("values, said", [({"start": [], "pool": []}, "test"), ({"start": 3}, "start"), ([], "")])
def test_a_wrong_value_is_named(tmp_path, values, said):
    write_json(tmp_path / "views.json", values)
    with pytest.raises(InputError, match=f"views.json: not as the workflow writes it .*{said}"):
        read_view_split(tmp_path / "views.json")
