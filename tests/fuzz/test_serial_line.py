"""The line to a camera rig, with whatever bytes come from it: an answer of the protocol, a refusal, or a restart."""

import numpy as np
import pytest
from fixtures.fuzzing import fuzz, mutate_bytes, randoms, read_guarded
from hypothesis import given

from dav_gswt.capture import serial_protocol
from dav_gswt.capture.serial_protocol import RigRestarted, SerialLine, frame_line
from dav_gswt.errors import InputError

pytestmark = pytest.mark.slow
ANSWERS = ("OK 1 -180 180 10 90 1000 8000 0 60 5000", "OK still 0.0 60.000 5000", "OK moving 1 2 3", "OK", "OK lost")
ANSWERS += ("OK stopped", "ERR RANGE tilt ends at 90", "ERR LOST", "ERR", "OK still nan 1 2", "OK 2", "OK 1")
ANSWERS += ("OK still 9999999.9 -9999999.9 0", "OK still 99999999 0 0", "OK still", "OK  still  1 2 3")
ANSWERS += ("OK 1 1e5 2 3 4 5 6 7 8 9",)
UNSOLICITED = ("! BOOT", "! LIMIT pan", "! STOP", "!", "! LIMIT", "! ?", "")


class FakePort:
    """A port that answers each request once, with bytes that are made of its sequence number; then it is silent."""

    def __init__(self, answer):
        self._answer, self._unread, self.asked = answer, b"", 0

    def write(self, data: bytes) -> None:
        self.asked += 1
        self._unread += self._answer(data.split()[0] if data.split() else b"0")

    @property
    def in_waiting(self) -> int:
        return len(self._unread)

    def read_until(self, end: bytes, size: int) -> bytes:
        at = self._unread.find(end)
        n = min(size, at + 1 if at >= 0 else len(self._unread))
        read, self._unread = self._unread[:n], self._unread[n:]
        return read


@fuzz
@given(random=randoms)
def test_whatever_a_rig_sends(random):
    answer, verb = random.choice(ANSWERS), random.choice(("hello", "where", "home", "shoot", "move", "stop"))
    prefix, mutated = random.choice(("", "", *UNSOLICITED)), random.random() < 0.6

    def make(sequence: bytes) -> bytes:
        data = (frame_line(prefix) if prefix else b"") + frame_line(f"{sequence.decode()} {answer}")
        return mutate_bytes(random, data, len(data)) if mutated else data

    line = SerialLine(FakePort(make), "/dev/rig", timeout=0.002, retries=1)

    def check(found):
        if verb == "where":
            assert found[0] in (True, False) and found[1].shape == (3,) and np.isfinite(found[1]).all()
        elif verb == "hello":
            assert np.isfinite(found.limits).all() and np.isfinite(found.home).all()
        else:
            assert found is None

    arguments = (np.array([1.0, 2.0, 3.0]),) if verb == "move" else ()
    refusals = (InputError, RigRestarted)
    before = serial_protocol.SLICE
    serial_protocol.SLICE = 0.001
    try:
        read_guarded("serial line", lambda: _call(line, verb, arguments), check, 200, "", refusals)
    finally:
        serial_protocol.SLICE = before


def _call(line: SerialLine, verb: str, arguments: tuple):
    try:
        return getattr(line, verb)(*arguments)
    except RigRestarted as error:
        raise RigRestarted("the rig has restarted") from error
