"""Overlays, and the numbers about frames."""

import numpy as np
import pytest
from fixtures.bundles import Ground

from dav_gswt.study.terrain.browser import served

OBLIQUE = dict(x=3.0, y=5.0, eye=2.0, yaw=20.0, pitch=-30.0)


@pytest.fixture(scope="module")
def uncertain(page_of):
    """A page whose tiles 0 to 7 have uncertainty 0 and whose others have 1."""

    def edit(manifest):
        for tile in manifest["tiles"]:
            tile["uncertainty"] = float(tile["tile"] >= 8)

    with served(page_of(Ground(), edit=edit)) as address:
        yield address


@pytest.mark.parametrize("overlay", ["tile", "level", "order"])
def test_an_overlay_paints_the_tiles_and_goes_again(still, uncertain, overlay):
    seen = still(uncertain, 160, 100)
    plain = seen.at(**OBLIQUE)
    seen.page.select_option("#overlay", overlay)
    painted = seen.picture()
    assert seen.state["overlay"] == overlay
    assert np.abs(painted - plain).mean() > 15
    seen.page.select_option("#overlay", "picture")
    assert (seen.picture() == plain).all()


def test_uncertain_tiles_are_warm_and_sure_ones_cool(still, uncertain):
    seen = still(uncertain, 160, 100)
    seen.page.evaluate("davgswt.overlay('uncertainty')")
    found = set()
    for i in range(6):
        picture = seen.at(x=(i + 0.5) * 4, y=2.0, eye=1.0, yaw=90, pitch=-90)
        red, _, blue = picture.mean((0, 1))
        tile = seen.state["under"]["tile"]
        assert (red > blue + 30) == (tile >= 8) and (blue > red + 30) == (tile < 8)
        found.add(tile >= 8)
    assert found == {True, False}


def test_frame_times_have_means_and_deviations_of_the_last_120(modules):
    found = modules.evaluate(
        """async () => {
          const { createFrameStats } = await import("./draw/pacing.js"), stats = createFrameStats();
          for (let k = 0; k < 200; k++) {
            stats.addTime("sort", k < 80 ? 1000 : k % 2 ? 3 : 5);
            stats.addFrame(k % 4 === 0);
          }
          return stats.summary();
        }"""
    )
    assert found == {"share": 0.25, "sort": {"mean": 4, "sd": pytest.approx((120 / 119) ** 0.5), "n": 120}}
