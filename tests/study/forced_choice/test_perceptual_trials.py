"""The kit: lists that are balanced and the same again, and a page that does not tell which crop is which."""

import json
import re
from collections import Counter

import pytest
from fixtures import answer_files

from dav_gswt.errors import InputError
from dav_gswt.files import read_json
from dav_gswt.study.forced_choice import kit, trials


@pytest.fixture(scope="module")
def drawn():
    return answer_files.drawn(crops=4, checks=2)


@pytest.fixture(scope="module")
def key(drawn):
    return trials.make_key(drawn, seed=7)


def on_the_left(key, number):
    """Of every comparison, how often its first crop is on the left."""
    counts = Counter()
    for name, left, _ in key["lists"][number]:
        item = key["items"][name]
        counts[item["a"], item["b"]] += left == item["pictures"][0]
    return counts


def test_every_list_has_every_pair_once_and_half_of_each_comparison_either_way_round(key):
    for number, listed in enumerate(key["lists"]):
        assert sorted(name for name, *_ in listed) == sorted(key["items"])
        assert all({left, right} == set(key["items"][name]["pictures"]) for name, left, right in listed)
        assert on_the_left(key, number) == {("semantic", "colour"): 4, ("semantic", "floor"): 4, ("plain", "check"): 2}


def test_of_an_odd_number_one_side_has_one_more_and_not_always_the_same(drawn):
    odd = trials.make_key(answer_files.drawn(crops=3, checks=0, scenes=("desert",)), seed=0)
    lefts = {on_the_left(odd, number)["semantic", "colour"] for number in range(trials.LISTS)}
    assert lefts == {1, 2}


def test_lists_come_in_twos_that_exchange_left_and_right(key):
    for first, second in zip(key["lists"][::2], key["lists"][1::2], strict=True):
        assert {name: (left, right) for name, left, right in first} == {
            name: (left, right) for name, right, left in second
        }
        assert [name for name, *_ in first] != [name for name, *_ in second]


def test_checks_are_spread_over_the_list(key):
    for listed in key["lists"]:
        checks = [k for k, (name, *_) in enumerate(listed) if key["items"][name]["check"]]
        stretch = len(listed) / 4
        assert [int(k // stretch) for k in checks] == [0, 1, 2, 3]


def test_the_same_seed_makes_the_same_kit_and_another_another(drawn, key):
    assert trials.make_key(drawn, seed=7) == key
    other = trials.make_key(drawn, seed=8)
    assert (
        other["study"] != key["study"]
        and other["lists"] != key["lists"]
        and not set(other["items"]) & set(key["items"])
    )


def test_the_page_tells_nothing_of_what_is_shown(tmp_path, drawn):
    page, path = answer_files.written(tmp_path, drawn)
    key = read_json(path)
    script = (page / kit.TRIALS).read_text()
    study = json.loads(re.fullmatch(r'"use strict";\nconst STUDY = (.+);\n', script)[1])
    assert study == {"study": key["study"], "seconds": 5.0, "lists": key["lists"]}
    for word in ("semantic", "colour", "floor", "check", "plain", "desert", "grass", "top", "t0:"):
        assert f'"{word}' not in script
    names = [picture for listed in key["lists"] for trial in listed for picture in trial]
    assert all(re.fullmatch(r"[0-9a-f]{12}|[0-9a-f]{16}", name) for name in names)
    assert sorted(p.name for p in page.iterdir()) == ["index.html", "main.js", "pictures", "style.css", "trials.js"]
    files = {p.stem: p.read_bytes() for p in (page / "pictures").iterdir()}
    assert len(files) == 2 * len(drawn)
    for item in key["items"].values():
        assert {files[name] for name in item["pictures"]} <= {data for pair in drawn for data in pair.pictures}
    assert all(not re.search(rb"tEXt|iTXt|zTXt|tIME", data[:200]) for data in files.values())


def test_the_name_of_a_picture_says_nothing_of_which_of_the_two_it_is(key):
    """First crops' names come before the others' about as often as after, and an item's name is of neither."""
    before = sum(item["pictures"][0] < item["pictures"][1] for item in key["items"].values())
    assert 3 < before < len(key["items"]) - 3  # of 20 fair coins, outside once in 400
    lists = key["lists"][0]
    assert [name for name, *_ in lists] != sorted(name for name, *_ in lists)


def test_the_same_picture_in_two_pairs_has_two_names():
    pair = answer_files.drawn(crops=1, checks=0, scenes=("desert",))[0]
    key = trials.make_key([pair, pair], seed=0)
    assert len({name for item in key["items"].values() for name in item["pictures"]}) == 4


def test_a_kit_without_pairs_is_refused_and_leaves_nothing(tmp_path):
    checks = [pair for pair in answer_files.drawn(crops=1) if pair.check]
    with pytest.raises(InputError, match="no pair to show"):
        answer_files.written(tmp_path, checks)
    assert not list(tmp_path.iterdir())
