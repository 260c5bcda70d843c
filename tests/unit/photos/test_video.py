"""Frames of a video: sharp ones, each a little farther along; and what is said of videos that cannot be used."""

from itertools import pairwise

import av
import numpy as np
import pytest
from fixtures import videos
from PIL import Image

from dav_gswt.errors import InputError
from dav_gswt.photos import video as tested
from dav_gswt.photos.video import write_frames


@pytest.fixture(scope="module")
def ground():
    return videos.make_ground()


@pytest.fixture
def filmed(tmp_path, ground):
    """A function that writes a video of a walk over the ground, or of other places."""

    def write(places=None, blurred=(), name="walk.mp4", **options):
        frames = videos.film(videos.walk(60) if places is None else places, blurred, ground=ground)
        return videos.write_video(tmp_path / name, frames, **options)

    return write


@pytest.fixture(scope="module")
def indexed(tmp_path_factory, ground):
    """The bytes of a video of 8 s whose index comes first."""
    folder = tmp_path_factory.mktemp("damaged")
    options = {"movflags": "faststart"}
    path = videos.write_video(folder / "whole.mp4", videos.film(videos.walk(120, 8), ground=ground), container=options)
    return path.read_bytes()


def numbers(paths):
    return [int(path.stem.removeprefix("frame_")) for path in paths]


def test_frames_are_a_step_apart_and_none_is_blurred(filmed, tmp_path):
    blurred = range(20, 32)
    chosen = numbers(write_frames(filmed(blurred=blurred), tmp_path / "out"))
    assert not set(chosen) & set(blurred)
    share = np.hypot(4 / videos.WIDTH, 1 / videos.HEIGHT)  # of a picture that the view moves on from frame to frame
    steps = [share * (b - a) for a, b in pairwise(chosen)]
    assert len(chosen) >= 5 and max(steps) < 2 * tested.STEP + 13 * share


def test_a_way_too_long_for_the_number_of_frames_is_cut_into_equal_stretches(filmed, tmp_path, caplog):
    video = filmed([(14 * i, 0) for i in range(75)])
    assert len(write_frames(video, tmp_path / "out", most=6)) == 6
    assert "the way is long: 6 frames overlap by" in caplog.text


def test_the_number_of_threads_changes_no_byte(filmed, tmp_path):
    video = filmed()
    one, two, three = (
        [path.read_bytes() for path in write_frames(video, tmp_path / str(threads), threads)] for threads in (1, 2, 3)
    )
    assert one == two == three


def test_a_trembling_camera_on_one_spot_is_refused(filmed, tmp_path):
    places = [(20 + 7 * i % 5, 20 + 5 * i % 7) for i in range(200)]
    with pytest.raises(InputError, match="walk.mp4: the camera stands still.*walk or fly along"):
        write_frames(filmed(places), tmp_path / "out")
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("threads", [1, 2])
def test_frames_before_the_damage_are_used(indexed, tmp_path, caplog, threads):
    """Half of the video is noise: what comes before is as in the whole video."""
    noise = np.random.default_rng(0).bytes(len(indexed))
    half = len(indexed) // 2
    said = []
    for name, data in {"whole": indexed, "cut": indexed[:half], "noise": indexed[:half] + noise[half:]}.items():
        (tmp_path / f"{name}.mp4").write_bytes(data)
        caplog.clear()
        write_frames(tmp_path / f"{name}.mp4", tmp_path / name, threads)
        said.append("is damaged or cut short after" in caplog.text)
    assert said == [False, True, True]
    whole, *parts = (sorted((tmp_path / name).iterdir()) for name in ("whole", "cut", "noise"))
    for part in parts:
        assert 3 <= len(part) < len(whole)
        same = [path for path in part if (tmp_path / "whole" / path.name).is_file()]
        assert len(same) >= len(part) - 2  # of the last stretches other frames may be the sharpest so far
        assert all(path.read_bytes() == (tmp_path / "whole" / path.name).read_bytes() for path in same)


def test_a_fault_that_cameras_write_does_no_harm(filmed, tmp_path):
    """The note with the encoder's name says that it is longer than it is: a strict decoder refuses the key frame."""
    video = filmed()
    data = bytearray(video.read_bytes())
    start = data.index(b"\x06\x05\xff\xff") + 2
    data[start : start + 6] = b"\xff" * 6
    (tmp_path / "faulty.mp4").write_bytes(data)
    assert len(write_frames(tmp_path / "faulty.mp4", tmp_path / "out")) == len(write_frames(video, tmp_path / "whole"))


def test_an_unreadable_video_is_named(indexed, tmp_path):
    for name, data in {"head.mp4": indexed[:600], "text.mp4": b"#EXTM3U\nother.mp4\n", "empty.mp4": b""}.items():
        (tmp_path / name).write_bytes(data)
        with pytest.raises(InputError, match=f"{name}: .*copy it again"):
            write_frames(tmp_path / name, tmp_path / "out")


def test_sound_alone_is_no_video(tmp_path):
    path = tmp_path / "song.mp4"
    with av.open(str(path), "w") as container:
        stream = container.add_stream("aac", rate=8000)
        frame = av.AudioFrame.from_ndarray(np.zeros((1, 1024), np.float32), "fltp", "mono")
        frame.sample_rate = 8000
        container.mux([*stream.encode(frame), *stream.encode(None)])
    with pytest.raises(InputError, match="song.mp4: has no moving pictures, only sound"):
        write_frames(path, tmp_path / "out")


def test_a_video_that_is_too_long_or_too_large_is_refused(filmed, tmp_path, monkeypatch):
    video = filmed()
    monkeypatch.setattr(tested, "LONGEST", 2.0)
    with pytest.raises(InputError, match="longer than an hour"):
        write_frames(video, tmp_path / "out")
    monkeypatch.setattr(tested.image_files, "MAX_PIXELS", 1000)
    with pytest.raises(InputError, match="320 x 192 pixels are too many"):
        write_frames(video, tmp_path / "out")


def test_a_video_of_a_phone_held_upright_gives_upright_frames(filmed, tmp_path):
    lying = [np.asarray(Image.open(path)) for path in write_frames(filmed(), tmp_path / "lying")]
    upright = write_frames(videos.turn_video(filmed(name="turned.mp4")), tmp_path / "upright")
    assert len(lying) == len(upright)
    for before, path in zip(lying, upright, strict=True):
        after = np.asarray(Image.open(path)).astype(int)
        assert np.abs(after - np.rot90(before, -1)).mean() < 3  # a quarter to the right; JPEG's error differs


def test_hdr_is_shown_as_bright_as_it_was(filmed, tmp_path):
    """HLG's middle is .598 of sRGB's white, and not .5."""
    plain = write_frames(filmed(name="8.mp4"), tmp_path / "8")
    hlg = write_frames(filmed(name="h.mp4", codec="libx265", pixels="yuv420p10le", hlg=True), tmp_path / "h")
    a, b = (np.asarray(Image.open(paths[0])) for paths in (plain, hlg))
    middle = np.abs(a.astype(int) - 128) < 2
    assert b[middle].mean() == pytest.approx(0.598 * 255, abs=4)


def test_blur_that_leaves_a_gap_is_said_with_its_time(filmed, tmp_path, caplog):
    write_frames(filmed(videos.walk(120), blurred=range(30, 90)), tmp_path / "out")
    assert "walk.mp4: is blurred from 2 s to 6 s" in caplog.text
