"""Photo mode: pictures of other sizes and fields of view, drawn with all Gaussians, with progress and a way out."""

import io

import numpy as np
import pytest
from fixtures.bundles import Ground
from PIL import Image

from dav_gswt.study.terrain.browser import served

OBLIQUE = dict(x=3.0, y=5.0, eye=2.0, yaw=20.0, pitch=-30.0)
SLOW = """const ask = WebGL2RenderingContext.prototype.getSyncParameter, born = new WeakMap();
WebGL2RenderingContext.prototype.getSyncParameter = function (sync, name) { // a slow device
  if (!born.has(sync)) born.set(sync, performance.now());
  return performance.now() - born.get(sync) < 400 ? this.UNSIGNALED : ask.call(this, sync, name);
};"""


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
        pytest.param([1280, 720], 4096, [[1280, 720], [2560, 1440], [4096, 2304]], id="device"),
        pytest.param([3840, 2160], 4096, [[3840, 2160]], id="no more"),
        pytest.param([360, 640], 4096, [[360, 640], [720, 1280], [1440, 2560]], id="upright"),
        pytest.param([5000, 5000], 4096, [[4096, 4096]], id="less than shown"),
    ],
)
def test_sizes_are_bounded_by_the_device(modules, shown, longest, sizes):
    found = modules.evaluate(
        """async ([[width, height], longest]) => {
          const { photoSizes } = await import("./ui/photo_mode.js");
          return photoSizes({ width, height }, longest).map(size => [size.width, size.height]);
        }""",
        [shown, longest],
    )
    assert found == sizes


def test_a_photo_as_shown_is_the_still_and_a_larger_one_shows_the_same(visit, plain):
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
    seen.until("davgswt.state.whole")
    assert (seen.picture() == expected).all(), "and the view goes on"


def test_a_wider_field_of_view_shows_more_and_ends_with_the_mode(visit, plain):
    seen = open_photo(visit(320, 200).open(plain))
    normal = take(seen)
    seen.page.locator("#photoView").fill("30")
    assert seen.page.locator("#photoViewText").inner_text() == "30°"
    narrow = take(seen)
    # tangents of 30 and 15 degrees: the narrow one is the middle 0.464 of the normal one
    w, h = round(320 * 0.4641), round(200 * 0.4641)
    cut = normal[(200 - h) // 2 : (200 + h) // 2, (320 - w) // 2 : (320 + w) // 2]
    fitted = np.asarray(Image.fromarray(cut.astype(np.uint8)).resize((320, 200), Image.Resampling.BILINEAR)).astype(int)
    assert np.abs(fitted - narrow).mean() < 4 < np.abs(normal - narrow).mean()
    seen.page.locator("#photoClose").click()
    seen.until("davgswt.state.whole")
    assert (seen.picture() == normal).all()


def test_a_photo_tells_how_far_it_is_and_is_given_up_when_asked(visit, page_of):
    with served(page_of(Ground(discs=48))) as address:
        seen = visit(480, 400)
        seen.page.add_init_script(SLOW)
        open_photo(seen.open(address))
        for give_up in (lambda: seen.page.keyboard.press("Escape"), lambda: seen.page.locator("#jobCancel").click()):
            seen.page.locator("#photoTake").click()
            seen.until("!job.hidden && jobBar.value > 0 && /Drawing the photo: \\d+ %/.test(jobText.textContent)")
            before = seen.state["x"]
            seen.page.keyboard.press("w")
            assert seen.state["x"] == before, "nobody walks out of a photo"
            give_up()
            seen.until("job.hidden && toast.textContent.includes('given up')")
            assert seen.page.locator("#photo").is_visible()
        assert seen.state["error"] is None


@pytest.mark.parametrize(
    "seconds, share, text",
    [
        (3, 0.1, ""),
        (10, 0, ""),
        (10, 0.9, ""),
        (10, 0.5, ", 10 s left"),
        (60, 0.1, ", 9 min left"),
        (60, 0.001, ", 17 h left"),
    ],
)
def test_who_waits_is_told_how_long(modules, seconds, share, text):
    said = modules.evaluate(
        """async ([seconds, share]) => {
          const { describeLeft } = await import("./ui/job.js");
          return describeLeft(seconds, share);
        }""",
        [seconds, share],
    )
    assert said == text


def test_a_photo_that_does_not_fit_is_refused_in_one_sentence(visit, plain):
    seen = open_photo(visit(320, 200).open(plain))
    seen.page.evaluate("WebGL2RenderingContext.prototype.getError = function () { return this.OUT_OF_MEMORY }")
    seen.page.locator("#photoTake").click()
    seen.until("!error.hidden")
    assert "Choose a smaller one" in seen.page.locator("#error").inner_text()
    assert not seen.page.locator("#job").is_visible()
