"""What a frame costs on any machine: draw calls and bytes uploaded. Times are measured by `make bench`."""

import pytest
from fixtures import bundles
from fixtures.browser import served
from fixtures.frame_counts import COUNT_CALLS, count_calls

from dav_gswt.terrain.heights import Hills

pytestmark = pytest.mark.slow
PLACE = dict(x=1.0, y=2.0, eye=1.6, yaw=60.0, pitch=-45.0)


@pytest.fixture(scope="module")
def address(page_of):
    """A page of three levels and shrubs on hills in the sun."""
    ground = bundles.Ground(levels=3, speckle=40, discs=40, things=4)
    sun = {"elevation": 40.0, "azimuth": 200.0, "source": "assumed"}
    surface = Hills(2.0, 30.0, 3, 5)
    with served(page_of(ground, surface=surface, edit=lambda manifest: manifest.update(light=sun))) as address:
        yield address


@pytest.mark.parametrize("change", [{}, {"yaw": 61}, {"x": 9.5, "pitch": -8}], ids=["same", "turn", "far"])
def test_a_frame_is_four_draw_calls_and_uploads_less_than_an_index_a_gaussian(visit, address, change):
    """Sky, far hills, cells, the near block. Gaussians stay on the card: blocks and the near order are uploaded."""
    counted = visit(320, 200)
    counted.page.add_init_script(COUNT_CALLS)
    counted.open(f"{address}?still")
    count_calls(counted, PLACE)
    counts = count_calls(counted, PLACE | change)
    assert counts.draws == 4
    assert 0 < counts.bytes < 4 * counted.state["count"]
