"""The agent of camera rigs, against a simulated one: whatever goes wrong, it stands still and no photo is lost."""

import re
import signal

import numpy as np
import pytest
from fixtures.frames import scene_frame
from fixtures.photo_store import read_records
from fixtures.simulated_rig import Faults, SimulatedRig
from hypothesis import given
from hypothesis import strategies as st

from dav_gswt.capture import serial_protocol, serial_rig
from dav_gswt.capture.store import PhotoStore, Site
from dav_gswt.config.scenes import SerialRig
from dav_gswt.errors import InputError
from dav_gswt.geometry import camera_layouts
from dav_gswt.geometry.poses import Pose
from dav_gswt.images import image_files

FRAME = scene_frame(exemplar=(1.0, -3.0, 4.0), flying_height=4.0)
CENTRE = (3.0, -1.0, 0.0)
PLACES = ((60.0, 10.0, 4.0), (45.0, 120.0, 4.0), (90.0, 30.0, 4.0), (50.0, 350.0, 3.0))
DEFAULTS = {name: field.default for name, field in SerialRig.model_fields.items() if not field.is_required()}
RIG = DEFAULTS | {
    "millimetres": 1000.0,
    "limits": {"pan": [-180, 180], "tilt": [10, 90], "radius": [1000, 8000]},
    "dry_run": False,
}


@pytest.fixture(autouse=True)
def no_long_waits(monkeypatch):
    monkeypatch.setattr(serial_rig, "PHOTO_POLL", 0.01)
    monkeypatch.setattr(serial_rig, "POLL", 0.005)
    monkeypatch.setattr(serial_protocol, "SLICE", 0.01)
    monkeypatch.setattr(serial_rig, "SETTLE", 0.0)
    monkeypatch.setattr(serial_protocol, "ANSWER_TIMEOUT", 0.05)  # a machine that stalls for longer only asks again
    monkeypatch.setattr(serial_protocol, "RETRIES", 60)
    monkeypatch.setattr(serial_rig, "PHOTO_TIMEOUT", 10.0)


@pytest.fixture
def shoot(tmp_path, monkeypatch):
    """Have places photographed by a rig with faults; returns the rig, what it ended with, and the store.

    Changed names in capitals are constants, others keys of the config.
    """
    (tmp_path / "inbox").mkdir()
    store = PhotoStore(tmp_path / "captures")

    def shot(faults=None, places=PLACES, seed=0, **changed):
        scene = {"agent": "serial"}
        for name in filter(str.isupper, list(changed)):
            monkeypatch.setattr(serial_protocol if name == "RETRIES" else serial_rig, name, changed.pop(name))
        with SimulatedRig(tmp_path / "inbox", faults, seed) as device:
            shot.device = device
            scene["rig"] = RIG | {"port": device.port, "inbox": str(tmp_path / "inbox")} | changed
            site = Site("meadow", scene, FRAME, tmp_path / "photos", store)
            asked = [posed(i, place) for i, place in enumerate(places)]
            missing = [(pose, camera) for pose, camera in asked if not store.photos_of(camera)]
            try:
                serial_rig.take_photos(site, missing)
                ended = ""
            except InputError as error:
                ended = str(error)
        return device, ended, store

    return shot


def posed(i, place):
    return Pose(f"pose_{i:04d}", *place), camera_layouts.orbit(*place, CENTRE, 64, 48, 60.0)


def held(store, places=PLACES):
    """How many photos of each place the store holds."""
    return [len(store.photos_of(posed(0, place)[1])) for place in places]


def test_each_pose_is_photographed_once_from_where_it_was_requested(shoot):
    device, ended, store = shoot()
    assert (ended, held(store), device.photos) == ("", [1, 1, 1, 1], 4)
    assert [record["pose"]["name"] for record in read_records(store)].count("pose_0000") == 1
    for i, place in enumerate(PLACES):
        camera = posed(i, place)[1]
        [stored] = store.photos_of(camera)
        assert image_files.read_photo(stored.photo).shape == (48, 64, 3)
        np.testing.assert_allclose(
            stored.camera.rotation, camera.rotation, atol=2e-5
        )  # the line's thousandth of a degree
        np.testing.assert_allclose(stored.camera.centre, camera.centre, atol=1e-4)
        assert stored.camera.fx == camera.fx


@pytest.mark.parametrize(
    "faults",
    [
        pytest.param(Faults(lost_in=0.004), id="bytes to it are lost"),
        pytest.param(Faults(lost_out=0.004), id="bytes from it are lost"),
        pytest.param(Faults(twice=True), id="answers come twice"),
        pytest.param(Faults(garbage=b"\xff\x00*\xc3#\n! BOOT*0000\n" + 300 * b"x" + b"\n\n"), id="garbage"),
        pytest.param(Faults(camera="slow"), id="photos are written slowly"),
    ],
)
def test_what_passes_costs_no_photo_and_takes_none_twice(shoot, faults):
    device, ended, store = shoot(faults, seed=3)
    assert (ended, held(store), device.photos) == ("", [1, 1, 1, 1], 4)


@pytest.mark.parametrize(
    "faults, changed, said",
    [
        pytest.param(Faults(answers={"HELLO": "OK 2"}), {}, "speaks version 2, not 1", id="another version"),
        pytest.param(Faults(silent=("SHOOT",)), {"RETRIES": 2}, "did not answer SHOOT, asked 3 times", id="silent"),
        pytest.param(Faults(refused={"MOVE": "FAULT motor 2"}), {}, "refused MOVE: FAULT motor 2", id="refuses a move"),
        pytest.param(Faults(unasked_during_move={1: "LIMIT tilt"}), {}, "limit switch (tilt)", id="limit switch"),
        pytest.param(Faults(answers={"WHERE": "OK stopped 0 0 0"}), {}, "stop button", id="stopped before"),
        pytest.param(Faults(answers={"WHERE": "OK still nan 1e9 0"}), {}, "is none of docs", id="no numbers"),
        pytest.param(Faults(answers={"WHERE": "OK moving 0 60 5000"}), {"MOVE_TIMEOUT": 0.2}, "still moves", id="slow"),
        pytest.param(Faults(stuck=(1,)), {}, "is it blocked", id="stuck half-way"),
        pytest.param(Faults(boot_during_move=(1,)), {}, "the rig restarted", id="restarts in a move"),
        pytest.param(Faults(answers={"MOVE": "ERR LOST x"}), {}, "the rig restarted", id="restarted without a word"),
        pytest.param(Faults(camera="none"), {"PHOTO_TIMEOUT": 0.2}, "no photo came into", id="no photo"),
        pytest.param(Faults(camera="cut"), {"PHOTO_TIMEOUT": 0.6}, "cut short", id="half a photo"),
        pytest.param(Faults(camera="two"), {}, "2 photos came for one exposure", id="two photos"),
        pytest.param(Faults(camera="small"), {}, "does not shrink", id="a photo of another camera"),
    ],
)
def test_what_does_not_pass_is_said_and_ends_with_stop(shoot, faults, changed, said):
    device, ended, store = shoot(faults, **changed)
    assert said in ended
    assert device.last == "STOP"
    assert held(store) == [0, 0, 0, 0]


def test_photos_before_a_fault_are_kept_and_not_taken_again(shoot):
    first, ended, store = shoot(Faults(unasked_during_move={3: "LIMIT pan"}))
    assert ("limit switch" in ended, first.last, held(store)) == (True, "STOP", [1, 1, 0, 0])
    second, ended, store = shoot()
    assert (ended, second.photos, held(store)) == ("", 2, [1, 1, 1, 1])


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGHUP])
def test_a_run_that_is_ended_stops_the_rig_and_keeps_the_photos(shoot, monkeypatch, tmp_path, number):
    where = serial_protocol.SerialLine.where

    def interrupted(self):
        if shoot.device.photos == 2 and shoot.device.verbs("MOVE")[2:]:
            signal.raise_signal(number)
        return where(self)

    monkeypatch.setattr(serial_protocol.SerialLine, "where", interrupted)
    with pytest.raises(KeyboardInterrupt):
        shoot()
    assert (shoot.device.last, held(PhotoStore(tmp_path / "captures"))) == ("STOP", [1, 1, 0, 0])


def test_a_repeated_release_takes_one_photo(shoot):
    device, ended, store = shoot(Faults(asked_twice=("SHOOT",)), places=PLACES[:1])
    numbers = [seq for seq, verb in device.seen if verb == "SHOOT"]
    assert (ended, device.photos, held(store, PLACES[:1])) == ("", 1, [1])
    assert len(set(numbers)) == 1 and len(numbers) >= 2


WIDE = RIG["limits"] | {"radius": [1, 99999]}
TWO_TOO_FAR = [PLACES[0], (5.0, 0.0, 4.0), (60.0, 0.0, 9.0), PLACES[1]]
BOTH_NAMED = (
    r"cannot reach 2 of 4 poses.*\n *pose_0001 .*: tilt 5 is outside 10 to 90\n *pose_0002 .*: radius 9000 is outs"
)


@pytest.mark.parametrize(
    "places, changed, said",
    [
        pytest.param(TWO_TOO_FAR, {}, BOTH_NAMED, id="the limits of the config"),
        pytest.param([(60.0, 0.0, 9.5)], {"limits": WIDE}, "radius 9500 is outside 500 to 9000", id="the rig's own"),
        pytest.param(PLACES, {"limits": WIDE | {"pan": [300, 400]}}, "nothing of it", id="none of the rig's own"),
        pytest.param(PLACES[1:2], {"limits": WIDE | {"pan": [100, 180]}}, "home .* cannot be used", id="home outside"),
    ],
)
def test_nothing_moves_where_a_pose_or_the_way_is_barred(shoot, places, changed, said):
    device, ended, _ = shoot(places=places, **changed)
    assert re.search(said, ended)
    assert device.verbs("HOME", "MOVE", "SHOOT") == []


def test_a_dry_run_moves_nothing_and_says_every_move(shoot, caplog):
    caplog.set_level("INFO")
    device, ended, store = shoot(dry_run=True)
    assert "dry run" in ended and "scenes.meadow.rig.dry_run: false" in ended
    assert {verb for _, verb in device.seen} == {"HELLO"} and DEFAULTS["dry_run"]
    assert [r.getMessage().split(":")[0] for r in caplog.records] == [f"pose_{i:04d}" for i in range(4)]
    assert "pan 120.0, tilt 45.0 degrees, radius 4000 mm" in caplog.text
    assert held(store) == [0, 0, 0, 0]


def test_what_was_in_the_inbox_before_is_not_taken_for_a_photo(shoot, tmp_path):
    old = tmp_path / "inbox" / "old.png"
    image_files.write_png(old, np.zeros((48, 64, 3)))
    (tmp_path / "inbox" / "shot.part").write_bytes(b"unfinished")
    _, ended, store = shoot()
    assert (ended, held(store)) == ("", [1, 1, 1, 1])
    assert "old.png" not in {record["source"] for record in read_records(store)}


def test_what_is_missing_is_said_and_only_poses_where_the_rig_may_stand_are_candidates(shoot, tmp_path):
    assert "rig.inbox" in shoot(inbox=str(tmp_path / "none"))[1]
    assert "does not open" in shoot(port=str(tmp_path / "none"))[1]
    assert "did not answer HELLO" in shoot(port="loop://", RETRIES=1)[1]  # an echo is no answer
    pool = [posed(i, place) for i, place in enumerate([(60.0, 0.0, 5.0), (60.0, 90.0, 5.0), (5.0, 0.0, 5.0)])]
    rig = RIG | {"limits": RIG["limits"] | {"radius": [4500, 5500], "pan": [-80, 80]}}
    assert [pose.name for pose, _ in serial_rig.filter_reachable({"rig": rig}, FRAME, pool)] == ["pose_0000"]
    with pytest.raises(InputError, match="none of the candidate poses"):
        serial_rig.filter_reachable({"rig": rig | {"limits": RIG["limits"] | {"radius": [1, 2]}}}, FRAME, pool)


@given(st.text(st.characters(min_codepoint=32, max_codepoint=126), min_size=1, max_size=100), st.data())
def test_a_line_survives_and_a_damaged_one_does_not(text, data):
    sent = serial_protocol.frame_line(text)
    assert serial_protocol.unframe_line(sent) == text
    at = data.draw(st.integers(0, len(sent) - 1))
    assert serial_protocol.unframe_line(sent[:at] + sent[at + 1 :]) in (None, text)
    byte = data.draw(st.integers(0, 255).filter(lambda b: b != sent[at]))
    damaged = sent[:at] + bytes([byte]) + sent[at + 1 :]
    assert serial_protocol.unframe_line(damaged) in (None, text)  # text: a digit in lower case
