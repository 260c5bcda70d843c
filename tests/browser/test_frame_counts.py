"""What a frame costs on any machine: draw calls, bytes uploaded, fragments. Times are measured by `make bench`."""

import pytest
from fixtures import bundles
from fixtures.frame_counts import COUNT_CALLS, COUNT_FRAGMENTS, count_calls
from fixtures.page_visit import Visit

from dav_gswt.study.terrain.browser import served
from dav_gswt.terrain.heights import Hills

pytestmark = pytest.mark.slow
PLACE = dict(x=1.0, y=2.0, eye=1.6, yaw=60.0, pitch=-45.0)


@pytest.fixture(scope="module")
def address(page_of):
    """A page of three levels and shrubs on hills."""
    ground = bundles.Ground(levels=3, speckle=40, discs=40, things=4)
    with served(page_of(ground, surface=Hills(2.0, 30.0, 3, 5))) as address:
        yield address


@pytest.fixture
def visit_with(visit, address):
    """Start a visit with a script of its own."""

    def start(script: str) -> Visit:
        seen = visit(320, 200)
        seen.page.add_init_script(script)
        return seen.open(f"{address}?still")

    return start


@pytest.mark.parametrize("change", [{}, {"yaw": 61}, {"x": 9.5, "pitch": -8}], ids=["same", "turn", "far"])
def test_a_frame_is_three_draw_calls_and_uploads_less_than_an_index_a_gaussian(visit_with, change):
    """Sky, cells, the block about the eye. Gaussians stay on the card: blocks and the near order are uploaded."""
    counted = visit_with(COUNT_CALLS)
    count_calls(counted, PLACE)
    counts = count_calls(counted, PLACE | change)
    assert counts.draws == 3
    assert 0 < counts.bytes < 4 * counted.state["count"]


def test_few_fragments_are_shaded_in_vain(visit_with):
    """A splat's quad is a square about a disc: at least 4 / pi of the fragments that show it are shaded."""
    means = {}
    for every in ("false", "true"):
        fragments = visit_with(COUNT_FRAGMENTS % every).at(**PLACE)[..., 1]
        assert fragments.max() < 255, "more than can be counted"
        means[every] = fragments.mean()
    assert 1 < means["false"] < means["true"] < 1.5 * means["false"]
