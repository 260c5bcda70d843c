"""Answers: files that are not trusted, who is counted, and what follows from scripted ones."""

import json

import pytest
from fixtures import answer_files

from dav_gswt.errors import InputError
from dav_gswt.files import read_json
from dav_gswt.images import image_files
from dav_gswt.study.forced_choice import answers, plots, results, trials


@pytest.fixture(scope="module")
def key():
    return trials.make_key(answer_files.drawn(), seed=0)


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
    key = trials.make_key(answer_files.drawn(crops=1, checks=5, scenes=("desert",)), seed=0)
    checks = [name for name, item in key["items"].items() if item["check"]]
    for wrong, kept in ((1, True), (2, False)):
        missed = [key["items"][name]["pictures"] for name in checks[:wrong]]
        given = answer_files.answers(key, 0, lambda item, missed=missed: item["pictures"] not in missed)
        assert (answers._exclusion_reason(given, key) is None) is kept


def test_two_files_of_one_participant_count_once_and_the_longer_counts(gather, key):
    short, long = (answer_files.answers(key, 4, attentive, upto) for upto in (5, None))
    found = gather(long, short, long)
    assert found.facts["copies"] == 2 and found.facts["participants"] == 1 and found.facts["incomplete"] == 0


def test_two_files_of_one_participant_that_contradict_each_other_are_named(gather, key):
    with pytest.raises(InputError, match=r"1\.json: contradicts .*0\.json"):
        gather(answer_files.answers(key, 4, attentive), answer_files.answers(key, 4, lambda item: True))


def changed(key, **change):
    return answer_files.answers(key, 0, attentive) | change


def first_answer(key, **change):
    given = answer_files.answers(key, 0, attentive)
    given["answers"][0] |= change
    return given


@pytest.mark.parametrize(
    "broken, said",
    [
        pytest.param(lambda key: "{", "not readable as JSON", id="cut short"),
        pytest.param(lambda key: "[" * 100000, "nested too deep", id="a tower"),
        pytest.param(lambda key: "1" * 5000, "not readable as JSON", id="a number without end"),
        pytest.param(lambda key: '{"ms": NaN}', "NaN is no number", id="no number"),
        pytest.param(lambda key: "[]", "is not of type 'object'", id="a list"),
        pytest.param(lambda key: changed(key, name="Ann"), "'name' was unexpected", id="a name"),
        pytest.param(lambda key: changed(key, version=2), "version: 1 was expected", id="another version"),
        pytest.param(lambda key: changed(key, consent=False), "consent: True was expected", id="no consent"),
        pytest.param(lambda key: changed(key, participant="../../x"), "participant: ", id="a path for a name"),
        pytest.param(lambda key: changed(key, list=99), "other trials than those of list 99", id="no such list"),
        pytest.param(lambda key: changed(key, list=3), "other trials than those of list 3", id="another list"),
        pytest.param(lambda key: changed(key, study="0" * 16), "answers to the kit 0000", id="another kit"),
        pytest.param(lambda key: first_answer(key, choice="both"), "answers.0.choice", id="both"),
        pytest.param(lambda key: first_answer(key, ms=-1), "answers.0.ms", id="before it was shown"),
        pytest.param(lambda key: first_answer(key, item="0" * 12), "other trials", id="a pair that is not there"),
        pytest.param(lambda key: " " * (answers.MAX_BYTES + 1), "bytes; answers have at most", id="too large"),
    ],
)
def test_a_file_that_is_not_what_the_page_saves_is_named_in_one_message(gather, key, broken, said):
    with pytest.raises(InputError, match=said) as refused:
        gather(answer_files.answers(key, 1, attentive), broken(key))
    assert "1.json" in str(refused.value) and len(str(refused.value)) < 500 and "\n" not in str(refused.value)


def test_another_file_is_no_key(tmp_path):
    (tmp_path / "key.json").write_text("[]")
    with pytest.raises(InputError, match="not a key"):
        answers.read_key(tmp_path / "key.json")


def rows_of(table, **which):
    return [row for row in table if all(row[key] == value for key, value in which.items())]


def test_scripted_answers_give_the_shares_that_they_were_scripted_with(gather, key):
    """Two of four people prefer semantic to colour throughout, one the other, one on desert alone."""
    rules = [lambda item: True, lambda item: True, lambda item: item["check"]]
    rules += [lambda item: item["check"] or item["scene"] == "desert"]
    people = gather(*(answer_files.answers(key, n, rule) for n, rule in enumerate(rules)))
    table = results.tabulate_choices(key, people.participants)
    (every,) = rows_of(table, first="semantic", second="colour", scene="every", observer=results.PEOPLE)
    assert (every["participants"], every["answers"]) == (4, 32)
    assert every["share"] == pytest.approx((1 + 1 + 0 + 0.5) / 4) and every["median_ms"] == 1200
    assert every["low"] < every["binomial_low"] < every["share"] < every["binomial_high"] < every["high"]
    (desert,) = rows_of(table, first="semantic", second="colour", scene="desert", observer=results.PEOPLE)
    assert desert["share"] == pytest.approx(3 / 4)


def test_without_answers_there_is_the_model_observer_alone_and_it_is_no_participant(gather, key):
    people = gather()
    assert people.facts["participants"] == 0
    table = results.tabulate_choices(key, people.participants)
    assert {row["observer"] for row in table} == {"model observer (LPIPS)"}
    assert all(row["participants"] == 0 and row["p"] is None for row in table)
    (colour,) = rows_of(table, second="colour", scene="every")
    (floor,) = rows_of(table, second="floor", scene="every")
    expected = [item["over"][0] < item["over"][1] for item in key["items"].values() if item["b"] == "colour"]
    assert colour["share"] == sum(expected) / 8 not in (0, 1) and floor["share"] == 0


def test_people_and_model_are_never_in_one_row(gather, key):
    table = results.tabulate_choices(
        key, gather(*(answer_files.answers(key, n, attentive) for n in (0, 1))).participants
    )
    for row in table:
        assert row["participants"] == (2 if row["observer"] == results.PEOPLE else 0)
    assert len(table) == 2 * 2 * 3  # observers, comparisons, every scene and each


def test_a_tie_of_the_model_observer_counts_as_half(key):
    items = {name: item | {"over": [0.1, 0.1]} for name, item in key["items"].items() if not item["check"]}
    assert results._tabulate_model(items)["share"] == 0.5


def test_the_paper_s_preference_stands_beside_the_comparison_that_it_made(key):
    items = {n: item | {"b": "semantic-nogamma"} for n, item in key["items"].items() if item["b"] == "colour"}
    every, *scenes = results.tabulate_choices(key | {"items": items}, [])
    assert every["paper_preference"] == "84.3" and all(row["paper_preference"] is None for row in scenes)


def test_with_neither_answers_nor_lpips_the_message_says_what_to_do(key):
    items = {name: item | {"over": [None, None]} for name, item in key["items"].items()}
    with pytest.raises(InputError, match="neither answers .* fetches it"):
        results.tabulate_choices(key | {"items": items}, [])


def test_the_figure_is_drawn_with_and_without_people(gather, key, tmp_path):
    for number, count in enumerate((0, 1, 3)):
        people = gather(*(answer_files.answers(key, n, attentive) for n in range(count)))
        plots.write_choice_plot(path := tmp_path / f"{number}.png", results.tabulate_choices(key, people.participants))
        assert image_files.read_size(path)[0] > 500


def test_a_written_key_is_read_as_it_was(tmp_path):
    _, path = answer_files.written(tmp_path)
    assert answers.read_key(path) == read_json(path)
