"""The examples of docs/python.md run on the tiny desert's photos."""

import re

import dav_gswt
from dav_gswt.images import image_files


def test_the_page_of_the_library_runs_as_it_stands(root, tiny, tmp_path, monkeypatch, capsys):
    (tmp_path / "results/desert").mkdir(parents=True)
    (tmp_path / "results/desert/photos").symlink_to(tiny.photos)
    monkeypatch.chdir(tmp_path)
    page = (root / "docs/python.md").read_text(encoding="utf-8")
    names = {}
    for block in re.findall(r"```python\n(.*?)```", page, re.S):
        exec(block, names)
    assert "take a photo at" in capsys.readouterr().out
    picture = image_files.read_photo(tmp_path / "terrain.png")
    assert picture.shape == (360, 640, 3) and picture.std() > 0.02
    field = dav_gswt.read_field(tmp_path / "field.ply")
    assert dav_gswt.render(field, names["camera"]).shape == (360, 640, 3)


def test_the_library_offers_what_its_page_says(root):
    page = (root / "docs/python.md").read_text(encoding="utf-8")
    from dav_gswt import api

    used = set(re.findall(r"dav_gswt\.(\w+)\(", page))
    assert used <= set(api.__all__) and len(used) >= 9
    assert all(callable(getattr(dav_gswt, name)) for name in api.__all__)
