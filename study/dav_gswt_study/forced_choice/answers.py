"""Answers of participants: untrusted files from the page, checked, and which of them count."""

import json
import logging
from dataclasses import dataclass
from pathlib import Path

from jsonschema import Draft202012Validator
from jsonschema.exceptions import best_match

from dav_gswt.errors import InputError
from dav_gswt.files import read_json
from dav_gswt_study.forced_choice.kit import FORMAT, VERSION, Trial

MAX_BYTES = 1 << 22  # of a file of answers; one of 10000 answers has less
MAX_FILES = 10000
MAX_WRONG = 0.2  # share of the attention checks
INCOMPLETE, INATTENTIVE = "incomplete", "attention"

_log = logging.getLogger(__name__)


@dataclass(frozen=True)
class Participant:
    """Answers of one participant. By pair: whether the first of the two was chosen, and the response time in ms."""

    name: str
    chosen: dict[str, bool]
    ms: dict[str, float]


@dataclass(frozen=True)
class AnswerSet:
    """The participants that count; facts: numbers of files and participants, and of those left out by reason."""

    participants: list[Participant]
    facts: dict


def read_key(path: Path | str) -> dict:
    """The key of a kit. Raises: InputError: it is none, or of another version."""
    key = read_json(path)
    if not isinstance(key, dict) or (key.get("format"), key.get("version")) != (FORMAT, VERSION):
        raise InputError(f"{path}: not a key of format {FORMAT!r}, version {VERSION}; make the kit again")
    return key


def read_answers(files: list[str], key: dict, schema: Path | str) -> AnswerSet:
    """All participants with a complete list who passed the attention checks.

    Two files of one participant are copies, or one is from earlier on: the longer counts. One who has more than
    MAX_WRONG of the checks wrong is left out whatever else was chosen; where there is no check nobody is.
    Raises: InputError: as `read_answer_file`; too many files; two files of one participant that contradict each other.
    """
    if len(files) > MAX_FILES:
        raise InputError(f"{Path(files[0]).parent}: {len(files)} files of answers; at most {MAX_FILES} are read")
    validator = Draft202012Validator(read_json(schema))
    by_name: dict[str, tuple[str, dict]] = {}
    for file in sorted(files):
        answer_file = read_answer_file(file, key, validator)
        name = answer_file["participant"]
        before = by_name.get(name, (file, answer_file))
        if not _same_start(before[1], answer_file):
            raise InputError(f"{file}: contradicts {before[0]}, of the same participant; remove the one that is wrong")
        by_name[name] = max(before, (file, answer_file), key=lambda each: len(each[1]["answers"]))
    facts = {"files": len(files), "copies": len(files) - len(by_name), INCOMPLETE: 0, INATTENTIVE: 0}
    kept = []
    for name, (_, answer_file) in sorted(by_name.items()):
        if why := _exclusion_reason(answer_file, key):
            facts[why] += 1
        else:
            kept.append(_make_participant(name, answer_file, key))
    facts |= {"participants": len(kept)}
    _log.info("%(files)d files of answers, %(copies)d of them copies", facts)
    _log.info("left out: %(incomplete)d incomplete, %(attention)d for their attention checks", facts)
    _log.info("participants %(participants)d", facts)
    return AnswerSet(kept, facts)


def read_answer_file(file: Path | str, key: dict, validator: Draft202012Validator) -> dict:
    """One file of answers, checked against the schema and the key's trial lists.

    Raises: InputError: too large, no JSON, not as the schema says, of another kit, or not of its list's trials.
    """
    answer_file = _read_json(Path(file))
    if error := best_match(validator.iter_errors(answer_file)):
        where = ".".join(str(part) for part in error.absolute_path)
        message = error.message if len(error.message) < 200 else f"is not what {error.validator} asks for"
        raise InputError(f"{file}: {where + ': ' if where else ''}{message}; remove it, or save it from the page again")
    if answer_file["study"] != key["study"]:
        raise InputError(
            f"{file}: answers to the kit {answer_file['study']}, not {key['study']}; move it out of this folder"
        )
    lists = key["lists"]
    trials: list[Trial] = lists[answer_file["list"]] if answer_file["list"] < len(lists) else []
    asked = [[one["item"], one["left"], one["right"]] for one in answer_file["answers"]]
    if asked != trials[: len(asked)]:
        raise InputError(f"{file}: answers other trials than those of list {answer_file['list']}; remove it")
    return answer_file


def _read_json(path: Path):
    try:
        size = path.stat().st_size
        if size > MAX_BYTES:
            raise InputError(f"{path}: {size} bytes; answers have at most {MAX_BYTES}; remove it")
        return json.loads(path.read_text(encoding="utf-8"), parse_constant=_refuse_constant)
    except (OSError, ValueError, RecursionError) as error:
        why = "nested too deep" if isinstance(error, RecursionError) else error
        raise InputError(f"{path}: not readable as JSON ({why}); remove it, or save it from the page again") from error


def _refuse_constant(name: str):
    raise ValueError(f"{name} is no number of JSON")


def _same_start(one: dict, other: dict) -> bool:
    """Whether the shorter's answers are the first ones of the longer."""
    count = min(len(one["answers"]), len(other["answers"]))
    return one["list"] == other["list"] and one["answers"][:count] == other["answers"][:count]


def _exclusion_reason(answer_file: dict, key: dict) -> str | None:
    if len(answer_file["answers"]) < len(key["lists"][answer_file["list"]]):
        return INCOMPLETE
    chosen = _choices(answer_file, key)
    right = [first for name, first in chosen.items() if key["items"][name]["check"]]
    return INATTENTIVE if right and right.count(False) > MAX_WRONG * len(right) else None


def _choices(answer_file: dict, key: dict) -> dict[str, bool]:
    answers = {one["item"]: one[one["choice"]] for one in answer_file["answers"]}
    return {name: picture == key["items"][name]["pictures"][0] for name, picture in answers.items()}


def _make_participant(name: str, answer_file: dict, key: dict) -> Participant:
    return Participant(
        name, _choices(answer_file, key), {one["item"]: float(one["ms"]) for one in answer_file["answers"]}
    )
