"""Videos of fly paths: frame by frame where the browser encodes frames, else recorded live, else refused."""

import base64

import numpy as np
import pytest

PATH = {
    "format": "davgswt-flight",
    "version": 1,
    "path": [
        dict(seconds=0, x=2.0, y=2.0, eye=1.0, yaw=0, pitch=-90),
        dict(seconds=0.5, x=2.0, y=2.0, eye=1.0, yaw=0, pitch=-90),
        dict(seconds=0.6, x=10.0, y=2.0, eye=1.0, yaw=0, pitch=-90),
        dict(seconds=1, x=10.0, y=2.0, eye=1.0, yaw=0, pitch=-90),
    ],
}
WATCH = """async ([data, moments]) => {
  // the middle pixel of a video at some moments, its length and size
  const video = document.createElement("video");
  const blob = await (await fetch(`data:video/webm;base64,${data}`)).blob();
  video.src = URL.createObjectURL(blob);
  video.muted = true;
  await new Promise((done, refuse) => {
    video.onloadeddata = done;
    video.onerror = () => refuse(new Error(video.error.message));
  });
  const seen = [];
  for (const moment of moments) {
    await new Promise(done => {
      video.onseeked = done;
      video.currentTime = moment;
    });
    const pen = Object.assign(document.createElement("canvas"), { width: 1, height: 1 }).getContext("2d");
    pen.drawImage(video, video.videoWidth / 2, video.videoHeight / 2, 1, 1, 0, 0, 1, 1);
    seen.push([...pen.getImageData(0, 0, 1, 1).data].slice(0, 3));
  }
  return [seen, video.duration, video.videoWidth, video.videoHeight];
}"""


@pytest.fixture
def flying(visit, plain):
    def start(script: str = "", path=PATH, **size):
        seen = visit(**size)
        seen.page.add_init_script(script)
        seen.open(plain)
        seen.page.evaluate("path => davgswt.flyPath.load(path)", path)
        seen.page.locator("#menuButton").click()
        return seen

    return start


def save(seen) -> bytes:
    seen.until("!video.disabled")
    with seen.page.expect_download(timeout=120_000) as download:
        seen.page.locator("#video").click()
    seen.until("job.hidden")
    assert download.value.suggested_filename == "endless-terrain-flight.webm"
    return download.value.path().read_bytes()


@pytest.mark.slow
def test_a_video_shows_each_moment_of_the_path(flying, modules):
    seen = flying(width=320, height=201)
    expected = [seen.at(**{k: PATH["path"][n][k] for k in ("x", "y", "eye", "yaw", "pitch")}) for n in (0, 3)]
    seen.until("menu.hidden")  # one has moved
    seen.page.locator("#menuButton").click()
    data = save(seen)
    assert data[:4] == b"\x1a\x45\xdf\xa3"
    pixels, seconds, width, height = modules.evaluate(WATCH, [base64.b64encode(data).decode(), [0.2, 0.9]])
    assert (width, height) == (320, 202), "an even number of pixels"
    assert seconds == pytest.approx(31 / 30, abs=0.02)
    for found, picture in zip(pixels, expected, strict=True):
        assert np.abs(np.array(found) - picture[100, 160]).max() < 16  # colours of video lose some
    assert seen.state["error"] is None


@pytest.mark.parametrize(
    "size, expected",
    [([1280, 720], [1280, 720]), ([2560, 1440], [1920, 1080]), ([361, 641], [362, 642]), ([1, 1], [2, 2])],
)
def test_videos_have_even_sizes(call, size, expected):
    found = call("ui/video.js", "videoSize", dict(zip(("width", "height"), size, strict=True)))
    assert [found["width"], found["height"]] == expected


WRITE = """async frames => {
  const { writeWebm } = await import("./data/webm.js");
  const track = { codec: "V_VP9", width: 320, height: 200, duration: 3000 };
  const bytes = writeWebm(track, frames.map(([milliseconds, key, size]) => (
    { milliseconds, key, data: new Uint8Array(size).fill(7) })));
  return btoa(String.fromCharCode(...bytes));
}"""


def parse(data: bytes) -> list:
    """Elements of EBML: id, where it begins, and what is in it."""
    masters = {0x1A45DFA3, 0x18538067, 0x1549A966, 0x1654AE6B, 0xAE, 0xE0, 0x1C53BB6B, 0xBB, 0xB7, 0x1F43B675}
    found, at = [], 0
    while at < len(data):
        begin, first = at, data[at]
        width = 9 - first.bit_length()
        name = int.from_bytes(data[at : at + width], "big")
        assert data[at + width] == 1
        size = int.from_bytes(data[at + width + 1 : at + width + 8], "big")
        at += width + 8
        body = data[at : at + size]
        assert len(body) == size
        found.append((name, begin, parse(body) if name in masters else body))
        at += size
    return found


def test_cues_point_at_clusters_which_begin_with_key_frames(modules):
    frames = [(0, True, 50), (33, False, 9), (67, False, 8), (2000, True, 40), (2033, False, 7)]
    (_, _, head), (_, _, segment) = parse(base64.b64decode(modules.evaluate(WRITE, frames)))
    assert dict((k, v) for k, _, v in head)[0x4282] == b"webm"
    clusters = [(at, dict((k, v) for k, _, v in body), body) for name, at, body in segment if name == 0x1F43B675]
    cues = next(body for name, _, body in segment if name == 0x1C53BB6B)
    points = []
    for _, _, point in cues:
        values = {k: v for k, _, v in point}
        places = {k: int.from_bytes(v, "big") for k, _, v in values[0xB7]}
        points.append((int.from_bytes(values[0xB3], "big"), places[0xF1]))
    assert points == [(0, clusters[0][0]), (2000, clusters[1][0])]
    blocks = [v for _, _, body in clusters for k, _, v in body if k == 0xA3]
    assert [int.from_bytes(v[1:3], "big") for v in blocks] == [0, 33, 67, 0, 33]
    assert [v[3] for v in blocks] == [0x80, 0, 0, 0x80, 0] and [len(v) - 4 for v in blocks] == [50, 9, 8, 40, 7]


@pytest.mark.parametrize(
    "frames", [[], [(0, False, 5)], [(0, True, 5), (40_000, False, 5)]], ids=["none", "no key", "far"]
)
def test_frames_that_make_no_video_are_refused(modules, frames):
    with pytest.raises(Exception, match="key frame"):
        modules.evaluate(WRITE, frames)
