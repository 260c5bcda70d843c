"""The serial protocol of a camera rig: requests and answers as lines of ASCII text (docs/rig-protocol.md).

    to the rig      <seq> <VERB> <words>*<crc>         41873 MOVE 12.500 45.000 1200.000*DD83
    its answers     <seq> OK <words>*<crc>             41873 OK*0539
                    <seq> ERR <code> <text>*<crc>      41874 ERR RANGE tilt ends at 90*D114
    unsolicited     ! BOOT, ! LIMIT <axis>, ! STOP     (each with *<crc>)

crc: CRC-16/CCITT-FALSE of the text before the star, four hexadecimal digits. A damaged or late line, or one with
another number, counts as lost. Without an answer in time the same line is sent again with the same number. A rig that
has acted on a number only repeats its answer, so a repeated SHOOT takes no second photo.
"""

import logging
import re
import secrets
import signal
import threading
import time
from binascii import crc_hqx
from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np
import serial
from jaxtyping import Float
from numpy import ndarray as Array

from dav_gswt.errors import InputError

_log = logging.getLogger(__name__)

VERSION = "1"
LONGEST = 160  # bytes of a line with its end; anything longer is noise
FIRST, LAST = 10000, 99999  # sequence numbers; a run starts at a random one, so answers to an earlier run are ignored
BAUD, ANSWER_TIMEOUT, RETRIES = 115_200, 2.0, 3  # seconds for an answer; how often a question is repeated
SLICE = 0.05  # seconds that one read waits
WRITE_TIMEOUT = 5.0  # seconds after which a line that takes no byte is broken: a busy machine may stall
TIMEOUT_FACTOR = {"SHOOT": 5.0}  # of a verb's answer: cameras block while they expose
STOPPED = "the rig's stop button is pressed; release it when the way is clear, then run the same again"
RESTARTED = "the rig restarted and lost its position; run the same again: photos taken until now are kept"
_NUMBER = re.compile(r"[+-]?[0-9]{1,7}(\.[0-9]{1,6})?")
_LINE = re.compile(rb"([\x20-\x7e]+)\*([0-9A-Fa-f]{4})\r?\n")


def frame_line(text: str) -> bytes:
    """Add the checksum and the line end."""
    data = text.encode("ascii")
    return b"%b*%04X\n" % (data, crc_hqx(data, 0xFFFF))


def unframe_line(line: bytes) -> str | None:
    """Return the text of a received line; None if it is damaged or not printable ASCII."""
    if not (found := _LINE.fullmatch(line)) or crc_hqx(found[1], 0xFFFF) != int(found[2], 16):
        return None
    return found[1].decode("ascii")


@contextmanager
def open_line(name: str) -> Iterator["SerialLine"]:
    """Open the line to the rig at a port. If the block fails, the rig is stopped, then the port closes.

    The rig is also stopped if the program is ended from outside: by Ctrl-C, a scheduler, or a closed terminal.

    Raises: InputError: the port does not open.
    """
    try:
        port = serial.serial_for_url(name, BAUD, timeout=SLICE, write_timeout=WRITE_TIMEOUT, exclusive=True)
    except (OSError, ValueError) as error:
        raise InputError(
            f"{name}: the rig's port does not open ({error}); check rig.port, and who may use it"
        ) from error
    line = SerialLine(port, name)
    with _signals_as_interrupt():
        try:
            yield line
        except BaseException:
            line.stop()
            raise
        finally:
            port.close()


@contextmanager
def _signals_as_interrupt():
    """Let SIGTERM and SIGHUP raise KeyboardInterrupt, as Ctrl-C does."""
    ends = (signal.SIGTERM, signal.SIGHUP) if threading.current_thread() is threading.main_thread() else ()
    before = {number: signal.signal(number, signal.default_int_handler) for number in ends}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


class SerialLine:
    """Sends one request at a time. port: of pyserial. name: for messages."""

    def __init__(self, port, name: str):
        self._port, self._name = port, name
        self._seq = FIRST + secrets.randbelow(LAST - FIRST)
        self._rest = b""

    def hello(self) -> tuple[Float[Array, "3 2"], Float[Array, "3"]]:
        """Ask for the limits of the axes and the position after HOME: degrees, degrees, millimetres.

        The rig forgets the numbers that it acted on.
        """
        words = self._request("HELLO", VERSION)
        if words[:1] != [VERSION]:
            raise InputError(f"{self._name}: the rig speaks version {' '.join(words[:1])}, not {VERSION}: update it")
        numbers = self._parse_numbers("HELLO", words[1:], 9)
        return numbers[:6].reshape(3, 2), numbers[6:]

    def home(self) -> None:
        """Begin homing."""
        self._request("HOME")

    def move(self, axes: Float[Array, "3"]) -> None:
        """Begin a straight move in the space of the axes."""
        self._request("MOVE", *(f"{value:.3f}" for value in axes))

    def where(self) -> tuple[bool, Float[Array, "3"]]:
        """Return whether the rig moves, and its position.

        Raises: InputError: the rig restarted and its position is unknown, or the stop button is pressed.
        """
        state, *words = self._request("WHERE") or [""]
        if state in ("lost", "stopped"):
            raise InputError(f"{self._name}: {RESTARTED if state == 'lost' else STOPPED}")
        if state not in ("still", "moving"):
            raise self._protocol_error("WHERE", [state, *words])
        return state == "moving", self._parse_numbers("WHERE", words, 3)

    def shoot(self) -> None:
        """Release the camera once."""
        self._request("SHOOT")

    def stop(self) -> None:
        """Stop the rig. A failure is logged, not raised."""
        try:
            self._request("STOP")
        except InputError as error:
            _log.warning("the rig did not confirm that it stands still: check it (%s)", error)

    def _request(self, verb: str, *words: str) -> list[str]:
        """Send a request until it is answered. Returns the words after OK.

        Raises: InputError: the rig refuses, is silent, or has restarted.
        """
        self._seq = self._seq + 1 if self._seq < LAST else FIRST
        text = " ".join([str(self._seq), verb, *words])
        wait = ANSWER_TIMEOUT * TIMEOUT_FACTOR.get(verb, 1.0)
        for _ in range(1 + RETRIES):
            with self._whole():
                self._port.write(b"\n" + frame_line(text))  # an empty line first ends the remains of a damaged one
            if (answer := self._read_answer(verb, wait)) is None:
                continue
            if answer[0] == "OK":
                return answer[1:]
            why = RESTARTED if answer[1:2] == ["LOST"] else " ".join(answer[1:]) or "no reason given"
            raise InputError(f"{self._name}: the rig refused {verb}: {why}")
        raise InputError(
            f"{self._name}: the rig did not answer {verb}, asked {1 + RETRIES} times with {wait:g} s each; "
            f"check that it is on, its cable, rig.port and its speed ({self._port.baudrate} bit/s)"
        )

    def _read_answer(self, verb: str, wait: float) -> list[str] | None:
        """Read the answer to the current request, from OK or ERR on; None on timeout."""
        until = time.monotonic() + wait
        while (text := self._read_line(until)) is not None:
            head, *words = text.split() or [""]
            if head == "!":
                self._handle_unsolicited(verb, words)
            elif head == str(self._seq) and words[:1] in (["OK"], ["ERR"]):
                return words
        return None

    def _handle_unsolicited(self, verb: str, words: list[str]) -> None:
        if verb in ("HELLO", "STOP"):  # old lines, or the effect of STOP itself
            return
        if words[:1] == ["BOOT"]:
            raise InputError(f"{self._name}: {RESTARTED}")
        if words[:1] == ["LIMIT"]:
            axis = " ".join(words[1:]) or "an axis"
            raise InputError(f"{self._name}: the rig ran into a limit switch ({axis}); free it, and check rig.limits")
        if words[:1] == ["STOP"]:
            raise InputError(f"{self._name}: {STOPPED}")

    def _read_line(self, until: float) -> str | None:
        """Read the next undamaged line; None on timeout."""
        while True:
            with self._whole():
                self._rest += self._port.read_until(b"\n", LONGEST - len(self._rest))
            if self._rest.endswith(b"\n") or len(self._rest) >= LONGEST:
                text, self._rest = unframe_line(self._rest), b""
                if text is not None:
                    return text
            if time.monotonic() > until:
                return None

    @contextmanager
    def _whole(self) -> Iterator[None]:
        """Raises: InputError: the line broke in the block."""
        try:
            yield
        except OSError as error:
            raise InputError(f"{self._name}: the line to the rig broke ({error}); check its cable") from error

    def _parse_numbers(self, verb: str, words: list[str], n: int) -> Float[Array, "n"]:
        if len(words) != n or not all(_NUMBER.fullmatch(word) for word in words):
            raise self._protocol_error(verb, words)
        return np.array(words, float)

    def _protocol_error(self, verb: str, words: list[str]) -> InputError:
        said = " ".join(words)
        return InputError(f"{self._name}: the rig's answer to {verb}, {said!r}, is none of docs/rig-protocol.md")
