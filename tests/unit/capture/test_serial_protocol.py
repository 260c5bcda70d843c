"""Lines to and from a camera rig: their checksum, what damages them, and the port that carries them."""

import pytest
from fixtures.simulated_rig import SimulatedRig
from hypothesis import given
from hypothesis import strategies as st

from dav_gswt.capture import serial_protocol
from dav_gswt.errors import InputError


def test_a_port_that_is_in_use_is_refused(tmp_path):
    with (
        SimulatedRig(tmp_path) as device,
        serial_protocol.open_line(device.port, 115200, 1.0, 1),
        pytest.raises(InputError, match="does not open"),
        serial_protocol.open_line(device.port, 115200, 1.0, 1),
    ):
        pass


def test_the_checksum_is_that_of_the_standard():
    assert serial_protocol.frame_line("123456789") == b"123456789*29B1\n"


@given(st.text(st.characters(min_codepoint=32, max_codepoint=126), min_size=1, max_size=100), st.data())
def test_a_line_survives_and_a_damaged_one_does_not(text, data):
    sent = serial_protocol.frame_line(text)
    assert serial_protocol.unframe_line(sent) == text
    at = data.draw(st.integers(0, len(sent) - 1))
    assert serial_protocol.unframe_line(sent[:at] + sent[at + 1 :]) in (None, text)
    byte = data.draw(st.integers(0, 255).filter(lambda b: b != sent[at]))
    assert serial_protocol.unframe_line(sent[:at] + bytes([byte]) + sent[at + 1 :]) in (
        None,
        text,
    )  # text: a digit in lower case


@given(st.binary(max_size=200))
def test_noise_is_no_line(noise):
    assert (
        serial_protocol.unframe_line(noise) is None
        or serial_protocol.frame_line(serial_protocol.unframe_line(noise))[:-1].lower() in noise.lower()
    )
