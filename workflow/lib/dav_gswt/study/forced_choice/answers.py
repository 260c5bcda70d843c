"""What people chose: files that came back from the page, none of them trusted, and whose answers count."""

import json
import logging
from dataclasses import dataclass
from pathlib import Path

from jsonschema import Draft202012Validator
from jsonschema.exceptions import best_match

from dav_gswt.errors import InputError
from dav_gswt.files import read_json
from dav_gswt.study.forced_choice.trials import FORMAT, VERSION, Trial

MOST_BYTES = 1 << 22  # of a file of answers; one of 10000 answers has less
MOST_FILES = 10000
MOST_WRONG = 0.2  # share of the attention checks
INCOMPLETE, INATTENTIVE = "incomplete", "attention"

_log = logging.getLogger(__name__)


@dataclass(frozen=True)
class Participant:
    """One person's answers. Of each pair: whether the first of the two was chosen, and after how many ms."""

    name: str
    chosen: dict[str, bool]
    ms: dict[str, float]


@dataclass(frozen=True)
class Gathered:
    """Those whose answers count, and how many files and people there were, and were left out for what."""

    participants: list[Participant]
    facts: dict


def read_key(path: Path | str) -> dict:
    """The key of a kit. Raises: InputError: it is none, or of another version."""
    key = read_json(path)
    if not isinstance(key, dict) or (key.get("format"), key.get("version")) != (FORMAT, VERSION):
        raise InputError(f"{path}: not a key of format {FORMAT!r}, version {VERSION}; make the kit again")
    return key


def gathered(files: list[str], key: dict, schema: Path | str) -> Gathered:
    """All participants of whom there is a complete list, and who did not fail the attention checks.

    Two files of one participant are copies, or one is from earlier on: the longer counts. One who has more than
    MOST_WRONG of the checks wrong is left out whatever else was chosen; where there is no check nobody is.
    Raises: InputError: as `read`; too many files; two files of one participant that contradict each other.
    """
    if len(files) > MOST_FILES:
        raise InputError(f"{Path(files[0]).parent}: {len(files)} files of answers; at most {MOST_FILES} are read")
    validator = Draft202012Validator(read_json(schema))
    told: dict[str, tuple[str, dict]] = {}
    for file in sorted(files):
        given = read(file, key, validator)
        name = given["participant"]
        before = told.get(name, (file, given))
        if not _same_start(before[1], given):
            raise InputError(f"{file}: contradicts {before[0]}, of the same participant; remove the one that is wrong")
        told[name] = max(before, (file, given), key=lambda each: len(each[1]["answers"]))
    facts = {"files": len(files), "copies": len(files) - len(told), INCOMPLETE: 0, INATTENTIVE: 0}
    kept = []
    for name, (_, given) in sorted(told.items()):
        if why := _left_out(given, key):
            facts[why] += 1
        else:
            kept.append(_participant(name, given, key))
    facts |= {"participants": len(kept)}
    _log.info("%(files)d files of answers, %(copies)d of them copies", facts)
    _log.info("left out: %(incomplete)d incomplete, %(attention)d for their attention checks", facts)
    _log.info("participants %(participants)d", facts)
    return Gathered(kept, facts)


def read(file: Path | str, key: dict, validator: Draft202012Validator) -> dict:
    """One file of answers, checked against the schema and the key's trial lists.

    Raises: InputError: too large, no JSON, not as the schema says, of another kit, or not of its list's trials.
    """
    given = _json(Path(file))
    if error := best_match(validator.iter_errors(given)):
        where = ".".join(str(part) for part in error.absolute_path)
        said = error.message if len(error.message) < 200 else f"is not what {error.validator} asks for"
        raise InputError(f"{file}: {where + ': ' if where else ''}{said}; remove it, or save it from the page again")
    if given["study"] != key["study"]:
        raise InputError(f"{file}: answers to the kit {given['study']}, not {key['study']}; move it out of this folder")
    lists = key["lists"]
    trials: list[Trial] = lists[given["list"]] if given["list"] < len(lists) else []
    asked = [[one["item"], one["left"], one["right"]] for one in given["answers"]]
    if asked != trials[: len(asked)]:
        raise InputError(f"{file}: answers other trials than those of list {given['list']}; remove it")
    return given


def _json(path: Path):
    try:
        size = path.stat().st_size
        if size > MOST_BYTES:
            raise InputError(f"{path}: {size} bytes; answers have at most {MOST_BYTES}; remove it")
        return json.loads(path.read_text(encoding="utf-8"), parse_constant=_refused)
    except (OSError, ValueError, RecursionError) as error:
        why = "nested too deep" if isinstance(error, RecursionError) else error
        raise InputError(f"{path}: not readable as JSON ({why}); remove it, or save it from the page again") from error


def _refused(name: str):
    raise ValueError(f"{name} is no number of JSON")


def _same_start(one: dict, other: dict) -> bool:
    """Whether the shorter's answers are the first ones of the longer."""
    count = min(len(one["answers"]), len(other["answers"]))
    return one["list"] == other["list"] and one["answers"][:count] == other["answers"][:count]


def _left_out(given: dict, key: dict) -> str | None:
    if len(given["answers"]) < len(key["lists"][given["list"]]):
        return INCOMPLETE
    chosen = _chosen(given, key)
    right = [first for name, first in chosen.items() if key["items"][name]["check"]]
    return INATTENTIVE if right and right.count(False) > MOST_WRONG * len(right) else None


def _chosen(given: dict, key: dict) -> dict[str, bool]:
    answers = {one["item"]: one[one["choice"]] for one in given["answers"]}
    return {name: picture == key["items"][name]["pictures"][0] for name, picture in answers.items()}


def _participant(name: str, given: dict, key: dict) -> Participant:
    return Participant(name, _chosen(given, key), {one["item"]: float(one["ms"]) for one in given["answers"]})
