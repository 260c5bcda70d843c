"""Photo mode: pictures of other sizes and fields of view, drawn with all Gaussians, with a way out."""

import io

import numpy as np
import pytest
from PIL import Image

OBLIQUE = dict(x=3.0, y=5.0, eye=2.0, yaw=20.0, pitch=-30.0)


def take(seen) -> np.ndarray:
    with seen.page.expect_download(timeout=60_000) as download:
        seen.page.locator("#photoTake").click()
    assert download.value.suggested_filename == "endless-terrain.png"
    return np.asarray(Image.open(io.BytesIO(download.value.path().read_bytes())).convert("RGB")).astype(int)


def open_photo(seen):
    seen.page.evaluate("place => davgswt.set(place)", OBLIQUE)
    seen.page.keyboard.press("f")
    seen.page.locator("#photo").wait_for(state="visible")
    return seen


@pytest.mark.parametrize(
    "shown, longest, sizes",
    [
        pytest.param([1280, 720], 16384, [[1280, 720], [2560, 1440], [5120, 2880]], id="all fit"),
        pytest.param([2560, 1440], 16384, [[2560, 1440], [5120, 2880]], id="canvas"),
        pytest.param([360, 640], 2048, [[360, 640], [720, 1280], [1152, 2048]], id="device, upright"),
        pytest.param([3840, 2160], 4096, [[3840, 2160]], id="no more"),
        pytest.param([5000, 5000], 4096, [[4096, 4096]], id="less than shown"),
    ],
)
def test_sizes_are_bounded_by_the_device(call, shown, longest, sizes):
    found = call("ui/photo_mode.js", "photoSizes", dict(zip(("width", "height"), shown, strict=True)), longest)
    assert [[size["width"], size["height"]] for size in found] == sizes


@pytest.mark.slow
def test_a_photo_shows_what_is_shown_in_the_size_and_field_of_view_that_were_chosen(visit, plain):
    seen = open_photo(visit(320, 200).open(plain))
    seen.until("davgswt.state.whole")
    expected = seen.picture()
    assert (take(seen) == expected).all()
    seen.page.select_option("#photoSize", index=2)
    large = take(seen)
    assert large.shape == (800, 1280, 3)
    small = large.reshape(200, 4, 320, 4, 3).mean((1, 3))
    # antialiased borders differ by a little; mirrored or shifted pictures by far more
    assert np.abs(small - expected).mean() < 3 < np.abs(small[::-1] - expected).mean()
    seen.page.select_option("#photoSize", index=0)
    seen.page.locator("#photoView").fill("30")
    narrow = take(seen)
    # tangents of 30 and 15 degrees: the narrow one is the middle 0.464 of the normal one
    w, h = round(320 * 0.4641), round(200 * 0.4641)
    cut = expected[(200 - h) // 2 : (200 + h) // 2, (320 - w) // 2 : (320 + w) // 2]
    fitted = np.asarray(Image.fromarray(cut.astype(np.uint8)).resize((320, 200), Image.Resampling.BILINEAR)).astype(int)
    assert np.abs(fitted - narrow).mean() < 4 < np.abs(expected - narrow).mean()
    seen.page.locator("#photoClose").click()
    seen.until("davgswt.state.whole")
    assert (seen.picture() == expected).all(), "and the view goes on"


@pytest.mark.slow
def test_a_photo_is_given_up_when_asked_and_refused_where_it_does_not_fit(visit, plain, slow_device):
    seen = visit(480, 400)
    seen.page.add_init_script(slow_device.replace("150", "400"))
    open_photo(seen.open(plain))
    for give_up in (lambda: seen.page.keyboard.press("Escape"), lambda: seen.page.locator("#jobCancel").click()):
        seen.page.locator("#photoTake").click()
        seen.until("!job.hidden && jobBar.value > 0")
        before = seen.state["x"]
        seen.page.keyboard.press("w")
        assert seen.state["x"] == before, "nobody walks out of a photo"
        give_up()
        seen.until("job.hidden")
    assert seen.state["error"] is None
    seen.page.evaluate("WebGL2RenderingContext.prototype.getError = function () { return this.OUT_OF_MEMORY }")
    seen.page.locator("#photoTake").click()
    seen.until("!error.hidden")
    assert "Choose a smaller one" in seen.page.locator("#error").inner_text()
    assert not seen.page.locator("#job").is_visible()
