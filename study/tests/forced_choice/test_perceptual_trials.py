import json
import re
from collections import Counter

import answer_files
import pytest

from dav_gswt.files import read_json
from dav_gswt_study.forced_choice import kit


@pytest.fixture(scope="module")
def drawn():
    return answer_files.drawn(crops=4, checks=2)


@pytest.fixture(scope="module")
def key(drawn):
    return kit.make_key(drawn, seed=7)


def test_every_list_has_every_pair_once_half_either_way_round_and_the_next_list_exchanges_left_and_right(key):
    for listed in key["lists"]:
        assert sorted(name for name, *_ in listed) == sorted(key["items"])
        lefts, checks = Counter(), []  # how often the first crop of a comparison is on the left
        for number, (name, left, right) in enumerate(listed):
            item = key["items"][name]
            assert {left, right} == set(item["pictures"])
            lefts[item["a"], item["b"]] += left == item["pictures"][0]
            checks += [number * 4 // len(listed)] if item["check"] else []
        assert lefts == {("semantic", "colour"): 4, ("semantic", "floor"): 4, ("plain", "check"): 2}
        assert checks == [0, 1, 2, 3]  # spread
    for first, second in zip(key["lists"][::2], key["lists"][1::2], strict=True):
        assert {name: (left, right) for name, left, right in first} == {
            name: (left, right) for name, right, left in second
        }
        assert [name for name, *_ in first] != [name for name, *_ in second]


def test_the_same_seed_makes_the_same_kit_and_another_another(drawn, key):
    assert kit.make_key(drawn, seed=7) == key
    other = kit.make_key(drawn, seed=8)
    assert other["study"] != key["study"] and other["lists"] != key["lists"]
    assert not set(other["items"]) & set(key["items"])


def test_the_page_tells_nothing_of_what_is_shown(tmp_path, drawn):
    page, path = answer_files.written(tmp_path, drawn)
    key = read_json(path)
    script = (page / kit.TRIALS).read_text()
    study = json.loads(re.fullmatch(r'"use strict";\nconst STUDY = (.+);\n', script)[1])
    assert study == {"study": key["study"], "seconds": 5.0, "lists": key["lists"]}
    names = [picture for listed in key["lists"] for trial in listed for picture in trial]
    assert all(re.fullmatch(r"[0-9a-f]{12}|[0-9a-f]{16}", name) for name in names)
    assert sorted(p.name for p in page.iterdir()) == ["index.html", "main.js", "pictures", "style.css", "trials.js"]
    files = {p.stem: p.read_bytes() for p in (page / "pictures").iterdir()}
    assert len(files) == 2 * len(drawn)
    for item in key["items"].values():
        assert {files[name] for name in item["pictures"]} <= {data for pair in drawn for data in pair.pictures}
    assert all(not re.search(rb"tEXt|iTXt|zTXt|tIME", data[:200]) for data in files.values())
