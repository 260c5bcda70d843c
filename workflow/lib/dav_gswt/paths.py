"""How paths spell numbers and when rounds stop: one spelling for each, so that what is alike meets in one place."""

import re
from decimal import Decimal

STOPS = {"photos": "_upto", "worth": "_worth"}  # keys of the config's `stop`, and what stands before their value


def spell(value: int | float | str) -> str:
    """The one spelling of a number that the constraints accept: 0.1, never 0.10."""
    text = f"{Decimal(str(value)).normalize():f}"
    return "0" if text == "-0" else text


def spell_stop(stop: dict) -> str:
    """When rounds stop, as it stands at the end of a branch's name; empty where they do not: _upto20_worth0.05."""
    return "".join(f"{mark}{spell(stop[key])}" for key, mark in STOPS.items() if key in stop)


def spell_completed(complete: bool, prior: str) -> str:
    """The directory level of a completed field, as it follows its round's; empty where none is asked for."""
    return f"/completed_{prior}" if complete else ""


def read_stop(spelled: str) -> dict:
    """The config's `stop` that a branch's name spells. Raises: ValueError: it is none."""
    pattern = "".join(rf"(?:{mark}(?P<{key}>[\d.]+))?" for key, mark in STOPS.items())
    found = re.fullmatch(pattern, spelled)
    values = {key: text for key, text in found.groupdict().items() if text} if found else {}
    stop = {key: int(text) if key == "photos" else float(text) for key, text in values.items()}
    if not found or spell_stop(stop) != spelled:
        raise ValueError(f"{spelled!r} does not say when rounds stop; one way to is '_upto20_worth0.05'")
    return stop
