"""What a frame costs on any machine: draw calls, bytes uploaded, fragments. Times are measured by `make bench`."""

import pytest
from fixtures import bundles
from fixtures.frame_counts import COUNT_CALLS, COUNT_FRAGMENTS, count_calls
from fixtures.page_visit import Visit

from dav_gswt.study.terrain.browser import served
from dav_gswt.terrain.heights import Hills

PLACE = dict(x=1.0, y=2.0, eye=1.6, yaw=60.0, pitch=-45.0)


@pytest.fixture(scope="module")
def address(page_of):
    """A page of three levels and shrubs on hills."""
    ground = bundles.Ground(levels=3, speckle=40, discs=40, things=4)
    with served(page_of(ground, surface=Hills(2.0, 30.0, 3, 5))) as address:
        yield address


def visit_with(chromium, script, address):
    context = chromium.new_context(viewport={"width": 320, "height": 200})
    page = context.new_page()
    page.add_init_script(script)
    return Visit(page).open(f"{address}?still")


@pytest.fixture(scope="module")
def counted(chromium, address):
    """A visit that counts calls, at PLACE."""
    visit = visit_with(chromium, COUNT_CALLS, address)
    count_calls(visit, PLACE)
    yield visit
    visit.page.context.close()


@pytest.mark.parametrize(
    "change",
    [{}, {"yaw": 61}, {"yaw": 240}, {"x": 1.2}, {"x": 9.5, "pitch": -8}],
    ids=["same", "turn", "back", "step", "far"],
)
def test_a_frame_is_three_draw_calls_and_uploads_less_than_an_index_a_gaussian(counted, change):
    """Sky, cells, the block about the eye. Gaussians stay on the card: blocks and the near order are uploaded."""
    counts = count_calls(counted, PLACE | change)
    assert counts.draws == 3
    assert 0 < counts.bytes < 4 * counted.state["count"]


def test_few_fragments_are_shaded_in_vain(chromium, address):
    """A splat's quad is a square about a disc: at least 4 / pi of the fragments that show it are shaded."""
    means = {}
    for every in ("false", "true"):
        visit = visit_with(chromium, COUNT_FRAGMENTS % every, address)
        fragments = visit.at(**PLACE)[..., 1]
        visit.page.context.close()
        assert fragments.max() < 255, "more than can be counted"
        means[every] = fragments.mean()
    assert 1 < means["false"] < means["true"] < 1.5 * means["false"]
