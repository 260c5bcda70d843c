import json

import answer_files
import pytest

from dav_gswt.errors import InputError
from dav_gswt_study.forced_choice import answers, kit, results


@pytest.fixture(scope="module")
def key():
    return kit.make_key(answer_files.drawn(), seed=0)


def attentive(item):
    """Whoever prefers semantic to colour, the floor to semantic, and passes checks."""
    return item["b"] != "floor"


@pytest.fixture
def gather(tmp_path, key):
    """Gather answers that are written to files first; strings are written as they are."""

    def call(*given):
        files = []
        for number, one in enumerate(given):
            files.append(tmp_path / f"{number}.json")
            files[-1].write_text(one if isinstance(one, str) else json.dumps(one))
        return answers.read_answers([str(file) for file in files], key, answer_files.SCHEMA)

    return call


def test_who_stopped_early_or_failed_the_checks_is_left_out_and_counted(gather, key):
    found = gather(
        answer_files.answers(key, 0, attentive),
        answer_files.answers(key, 1, attentive, upto=5),
        answer_files.answers(key, 2, lambda item: not item["check"]),
        answer_files.answers(key, 3, attentive),
    )
    assert found.facts == {"files": 4, "copies": 0, "incomplete": 1, "attention": 1, "participants": 2}
    assert [each.name[-1] for each in found.participants] == ["0", "3"]


def test_a_fifth_of_the_checks_may_be_wrong():
    key = kit.make_key(answer_files.drawn(crops=1, checks=5, scenes=("desert",)), seed=0)
    checks = [name for name, item in key["items"].items() if item["check"]]
    for wrong, kept in ((1, True), (2, False)):
        missed = [key["items"][name]["pictures"] for name in checks[:wrong]]
        given = answer_files.answers(key, 0, lambda item, missed=missed: item["pictures"] not in missed)
        assert (answers._exclusion_reason(given, key) is None) is kept


def test_two_files_of_one_participant_count_once_and_the_longer_counts(gather, key):
    short, long = (answer_files.answers(key, 4, attentive, upto) for upto in (5, None))
    found = gather(long, short, long)
    assert found.facts["copies"] == 2 and found.facts["participants"] == 1 and found.facts["incomplete"] == 0
    with pytest.raises(InputError, match=r"1\.json: contradicts .*0\.json"):
        gather(long, answer_files.answers(key, 4, lambda item: True))


def changed(**change):
    return lambda given: given | change


def first_answer(**change):
    return lambda given: given | {"answers": [given["answers"][0] | change, *given["answers"][1:]]}


@pytest.mark.parametrize(
    "broken, said",
    [
        ("[" * 100000, "nested too deep"),
        ('{"ms": NaN}', "NaN is no number"),
        (" " * (answers.MAX_BYTES + 1), "bytes; answers have at most"),
        (changed(participant="../../x"), "participant: "),
        (changed(list=3), "other trials than those of list 3"),
        (changed(study="0" * 16), "answers to the kit 0000"),
        (first_answer(item="0" * 12), "other trials"),
    ],
    ids=lambda value: value[:20] if isinstance(value, str) else "broken",
)
def test_a_file_that_is_not_what_the_page_saves_is_named_in_one_message(gather, key, broken, said):
    bad = broken if isinstance(broken, str) else broken(answer_files.answers(key, 0, attentive))
    with pytest.raises(InputError, match=said) as refused:
        gather(answer_files.answers(key, 1, attentive), bad)
    assert "1.json" in str(refused.value) and len(str(refused.value)) < 500 and "\n" not in str(refused.value)


def test_scripted_answers_give_the_shares_that_they_were_scripted_with(gather, key):
    """Two of four people prefer semantic to colour throughout, one the other, one on desert alone."""
    rules = [lambda item: True, lambda item: True, lambda item: item["check"]]
    rules += [lambda item: item["check"] or item["scene"] == "desert"]
    people = gather(*(answer_files.answers(key, n, rule) for n, rule in enumerate(rules)))
    table = results.tabulate_choices(key, people.participants)
    assert len(table) == 2 * 3  # comparisons, every scene and each
    at = {(row["second"], row["scene"]): row for row in table}
    every = at["colour", "every"]
    assert (every["participants"], every["answers"]) == (4, 32)
    assert every["share"] == pytest.approx((1 + 1 + 0 + 0.5) / 4) and every["median_ms"] == 1200
    assert every["low"] < every["binomial_low"] < every["share"] < every["binomial_high"] < every["high"]
    assert at["colour", "desert"]["share"] == pytest.approx(3 / 4)


def test_without_answers_one_message_says_where_they_belong(gather, key):
    with pytest.raises(InputError, match="no answers that count; `answers`"):
        results.tabulate_choices(key, gather().participants)
