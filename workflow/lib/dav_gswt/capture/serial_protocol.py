"""The line to a camera rig: short questions and answers of ASCII text over a serial port (docs/rig-protocol.md).

    to the rig      <seq> <VERB> <words>*<crc>         41873 MOVE 12.500 45.000 1200.000*DD83
    its answers     <seq> OK <words>*<crc>             41873 OK*0539
                    <seq> ERR <code> <text>*<crc>      41874 ERR RANGE tilt ends at 90*D114
    unasked         ! BOOT, ! LIMIT <axis>, ! STOP     (each with *<crc>)

crc: CRC-16/CCITT-FALSE of what stands before the star, four hexadecimal digits. A line that comes damaged, late or
for another number counts as lost. Without an answer in time the same line is sent again, with the same number, and a
rig that has acted on that number only repeats its answer: a repeated SHOOT takes no second photo.
"""

import logging
import re
import secrets
import signal
import threading
import time
from binascii import crc_hqx
from contextlib import contextmanager
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array

from dav_gswt.errors import InputError

_log = logging.getLogger(__name__)

VERSION = "1"
LONGEST = 160  # bytes of a line with its end: what runs on is noise
FIRST, LAST = 10000, 99999  # numbers of lines; a run begins anywhere, so answers to an earlier run mean nothing to it
SLICE = 0.05  # seconds that one read waits
PATIENCE = {"SHOOT": 5.0}  # times the time-out that a verb's answer may take: cameras block while they expose
BEGINNINGS = ("HELLO", "HOME", "STOP")  # verbs that need no known place, so that a restart before them does not matter
STOPPED = "the rig's stop button is pressed; release it when the way is clear, then run the same again"
_NUMBER = re.compile(r"-?[0-9]{1,7}(\.[0-9]{1,6})?")
_LINE = re.compile(rb"([\x20-\x7e]+)\*([0-9A-Fa-f]{4})\r?\n")


class Rebooted(Exception):
    """The rig has restarted: it does not know where it stands until it is homed."""


@dataclass(frozen=True)
class Device:
    """What a rig says of itself, in degrees, degrees, millimetres. limits: of each axis. home: where HOME ends."""

    limits: Float[Array, "3 2"]
    home: Float[Array, "3"]


def framed(text: str) -> bytes:
    """A line as it is sent, with its checksum and end."""
    data = text.encode("ascii")
    return b"%b*%04X\n" % (data, crc_hqx(data, 0xFFFF))


def unframed(line: bytes) -> str | None:
    """The text of a line as it came; None where it is damaged, or not printable ASCII."""
    if not (found := _LINE.fullmatch(line)) or crc_hqx(found[1], 0xFFFF) != int(found[2], 16):
        return None
    return found[1].decode("ascii")


@contextmanager
def opened(name: str, baud: int, timeout: float, retries: int):
    """A line to the rig at a port. However the block fails, the rig is told to stop, then the port closes.

    That is so when the program is ended from outside, too: by Ctrl-C, by a scheduler, with its terminal.

    Raises: InputError: pyserial is missing, or the port does not open.
    """
    try:
        import serial  # here: only scenes with a rig need it
    except ImportError as error:
        raise InputError("the agent serial needs pyserial: pip install pyserial==3.5") from error
    try:
        port = serial.serial_for_url(name, baud, timeout=SLICE, write_timeout=timeout, exclusive=True)
    except (OSError, ValueError) as error:
        raise InputError(
            f"{name}: the rig's port does not open ({error}); check rig.port, and who may use it"
        ) from error
    line = Line(port, name, timeout, retries)
    with _ended_as_by_ctrl_c():
        try:
            yield line
        except BaseException:
            line.stop()
            raise
        finally:
            port.close()


@contextmanager
def _ended_as_by_ctrl_c():
    """Have the signals that would end the program at once raise KeyboardInterrupt, as Ctrl-C does."""
    ends = (signal.SIGTERM, signal.SIGHUP) if threading.current_thread() is threading.main_thread() else ()
    before = {number: signal.signal(number, signal.default_int_handler) for number in ends}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


class Line:
    """One question at a time. port: as pyserial opens it. name: for messages. timeout: seconds an answer may take."""

    def __init__(self, port, name: str, timeout: float, retries: int):
        self._port, self._name, self._timeout, self._retries = port, name, timeout, retries
        self._seq = FIRST + secrets.randbelow(LAST - FIRST)
        self._rest = b""

    def hello(self) -> Device:
        """Who is there? A rig that hears this forgets the numbers that it acted on."""
        words = self._ask("HELLO", VERSION)
        if words[:1] != [VERSION]:
            raise InputError(f"{self._name}: the rig speaks version {' '.join(words[:1])}, not {VERSION}: update it")
        numbers = self._numbers("HELLO", words[1:], 9)
        return Device(numbers[:6].reshape(3, 2), numbers[6:])

    def home(self) -> None:
        """Begin to seek the axes' reference marks."""
        self._ask("HOME")

    def move(self, axes: Float[Array, "3"]) -> None:
        """Begin a move in a straight line in the space of the axes."""
        self._ask("MOVE", *(f"{value:.3f}" for value in axes))

    def where(self) -> tuple[bool, Float[Array, "3"]]:
        """Whether it moves, and where it is.

        Raises: Rebooted: it does not know. InputError: its stop button is pressed.
        """
        state, *words = self._ask("WHERE") or [""]
        if state == "lost":
            raise Rebooted
        if state == "stopped":
            raise InputError(f"{self._name}: {STOPPED}")
        if state not in ("still", "moving"):
            raise self._strange("WHERE", [state, *words])
        return state == "moving", self._numbers("WHERE", words, 3)

    def shoot(self) -> None:
        """Release the camera once."""
        self._ask("SHOOT")

    def stop(self) -> None:
        """Have it stand still, as well as can be: what prevents that is said, not raised."""
        try:
            self._ask("STOP")
        except (InputError, Rebooted) as error:
            _log.warning("the rig did not confirm that it stands still: look after it (%s)", error)

    def _ask(self, verb: str, *words: str) -> list[str]:
        """Send a line until it is answered. Returns: the words after OK.

        Raises: Rebooted: it has, and the verb needs a known place. InputError: it refuses, or is silent.
        """
        self._seq = self._seq + 1 if self._seq < LAST else FIRST
        text = " ".join([str(self._seq), verb, *words])
        patience = self._timeout * PATIENCE.get(verb, 1.0)
        if self._pending():
            self._answer(verb, SLICE)  # what came unasked, before anything new is begun
        for _ in range(1 + self._retries):
            self._send(b"\n" + framed(text))  # an end first, for what a lost one left behind
            if (answer := self._answer(verb, patience)) is not None:
                return self._accepted(verb, answer)
        raise InputError(
            f"{self._name}: the rig did not answer {verb}, asked {1 + self._retries} times with {patience:g} s each; "
            "check that it is on, its cable, rig.port and rig.baud"
        )

    def _answer(self, verb: str, patience: float) -> list[str] | None:
        """OK or ERR and what follows, for the present number; None when the time is up."""
        until = time.monotonic() + patience
        while (text := self._heard(until)) is not None:
            head, *words = text.split() or [""]
            if head == "!":
                self._unasked(verb, words)
            elif head == str(self._seq) and words[:1] in (["OK"], ["ERR"]):
                return words
        return None

    def _accepted(self, verb: str, answer: list[str]) -> list[str]:
        if answer[0] == "OK":
            return answer[1:]
        if answer[1:2] == ["LOST"] and verb not in BEGINNINGS:
            raise Rebooted
        raise InputError(f"{self._name}: the rig refused {verb}: {' '.join(answer[1:]) or 'no reason given'}")

    def _unasked(self, verb: str, words: list[str]) -> None:
        if verb in ("HELLO", "STOP"):  # of before, or what STOP is for
            return
        if words[:1] == ["BOOT"] and verb not in BEGINNINGS:
            raise Rebooted
        if words[:1] == ["LIMIT"]:
            axis = " ".join(words[1:]) or "an axis"
            raise InputError(f"{self._name}: the rig ran into a limit switch ({axis}); free it, and check rig.limits")
        if words[:1] == ["STOP"]:
            raise InputError(f"{self._name}: {STOPPED}")

    def _heard(self, until: float) -> str | None:
        """The next sound line; None when the time is up."""
        while True:
            try:
                self._rest += self._port.read_until(b"\n", LONGEST - len(self._rest))
            except OSError as error:
                raise self._broken(error) from error
            if self._rest.endswith(b"\n") or len(self._rest) >= LONGEST:
                text, self._rest = unframed(self._rest), b""
                if text is not None:
                    return text
            if time.monotonic() > until:
                return None

    def _pending(self) -> bool:
        """Has something come that was not read?"""
        try:
            return bool(self._port.in_waiting)
        except OSError as error:
            raise self._broken(error) from error

    def _send(self, data: bytes) -> None:
        try:
            self._port.write(data)
        except OSError as error:
            raise self._broken(error) from error

    def _numbers(self, verb: str, words: list[str], n: int) -> Float[Array, "n"]:
        if len(words) != n or not all(_NUMBER.fullmatch(word) for word in words):
            raise self._strange(verb, words)
        return np.array(words, float)

    def _strange(self, verb: str, words: list[str]) -> InputError:
        said = " ".join(words)
        return InputError(f"{self._name}: the rig's answer to {verb}, {said!r}, is none of docs/rig-protocol.md")

    def _broken(self, error: OSError) -> InputError:
        return InputError(f"{self._name}: the line to the rig broke ({error}); check its cable")
