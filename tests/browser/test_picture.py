"""What the page draws: ground where ground is, no holes, the same picture for everybody, and overlays."""

import numpy as np
import pytest
from fixtures import bundles
from fixtures.browser import served
from fixtures.bundles import Ground, colour_of, tile_at

SIDE, SALT = Ground().side, Ground().salt
OBLIQUE = dict(x=3.0, y=5.0, eye=2.0, yaw=20.0, pitch=-30.0)


@pytest.fixture(scope="module")
def behind_magenta(page_of):
    """A page whose far ground and sky are magenta: it shines through every hole."""
    pink = [1, 0, 1]
    edit = {"ground_colour": pink, "sky": {"zenith": pink, "horizon": pink}}
    with served(page_of(Ground(), edit=lambda manifest: manifest.update(edit))) as address:
        yield address


def through(picture) -> np.ndarray:
    """How much magenta shows, 0 to 1: tiles hold at most 60 of 255 in blue, of which this is the excess."""
    return np.clip((picture[..., 2] - 60) / 195, 0, 1)


def test_east_is_right_and_north_is_up_when_one_faces_north(still, plain):
    picture = still(plain).at(x=0.0, y=0.0, eye=3.0, yaw=90, pitch=-90)
    height, width, _ = picture.shape
    for i, row in ((-1, "left"), (0, "right")):
        for j in (-1, 0):
            # cell (0, 0) lies north-east of the corner in the middle; look a third of the way to the picture's corner
            y, x = height // 2 - (j * 2 + 1) * height // 4, width // 2 + (i * 2 + 1) * width // 4
            expected = colour_of(tile_at(i, j, SALT))
            assert np.abs(picture[y, x] - expected).max() <= 6, (row, j)


def test_sky_is_above_the_horizon_and_ground_below_it(still, plain):
    picture = still(plain).at(x=2.0, y=2.0, eye=1.0, yaw=60, pitch=0) / 255
    middle = len(picture) // 2
    horizon, zenith = np.array(bundles.SKY["horizon"]), np.array(bundles.SKY["zenith"])
    focal = 160 / np.tan(np.radians(30))
    rise = (middle - 0.5 - np.arange(middle - 2)) / focal
    expected = horizon + (zenith - horizon) * np.sqrt(rise / np.hypot(rise, 1))[:, None]
    # the column in the middle; 8-bit colours round by half a step
    assert np.abs(picture[: middle - 2, 160] - expected).max() < 1.6 / 255
    assert (picture[middle + 2 :, :, 2] < 0.6).all(), "the ground is not blue"
    assert picture.max(-1).min() > 0.3, "nothing is black"


@pytest.mark.parametrize(
    "place",
    [
        pytest.param(OBLIQUE, id="oblique"),
        pytest.param(dict(x=0.0, y=0.0, eye=12.0, pitch=-90), id="from above"),
        pytest.param(dict(x=51234.5, y=-70000.25, eye=2.0, pitch=-30, yaw=200), id="kilometres out"),
    ],
)
def test_the_ground_has_no_holes(still, behind_magenta, place):
    picture = still(behind_magenta).at(**place)
    # discs of opacity 250/255 whose deviation is 0.7 of their spacing overlap so much that less than 3 % is let through
    assert through(picture).max() < 0.03


@pytest.mark.parametrize("budget", [2_500, 1_000])
def test_a_small_budget_draws_coarser_ground_and_no_holes(still, behind_magenta, budget):
    seen = still(behind_magenta)
    seen.page.evaluate("place => davgswt.set(place)", dict(x=2.0, y=2.0, eye=1.0, yaw=60, pitch=-25))
    picture = seen.picture(budget)
    state = seen.state
    assert 0.3 * budget < state["count"] <= budget
    # the lower half of the picture is less than two tile sides away
    assert through(picture[100:]).max() < 0.03
    assert state["reach"] > 3 * SIDE


def test_a_link_brings_another_person_to_the_same_place_and_the_same_bits(visit, still, plain):
    expected = still(plain).at(**OBLIQUE)
    other = visit().open(f"{plain}?still#3,5,2,20,-30")
    assert {k: other.state[k] for k in OBLIQUE} == OBLIQUE
    assert (other.picture() == expected).all() and expected.std() > 10


def test_two_to_the_32_cells_out_the_same_tiles_and_steps_give_the_same_bits(still, plain):
    # The hash repeats after 2^32 cells, and 2^32 cells of side 4 are a distance that doubles hold exactly. Were
    # positions single precision, the step would be lost there, where floats are 2048 units apart.
    seen, pictures = still(plain), []
    for cells in (0, 2**32):
        place = OBLIQUE | {"x": OBLIQUE["x"] + cells * SIDE, "y": OBLIQUE["y"] - cells * SIDE}
        pictures.append([seen.at(**place), seen.at(**place | {"x": place["x"] + 2**-4})])
    assert (np.array(pictures[0]) == pictures[1]).all()
    assert (pictures[0][0] != pictures[0][1]).any()


def test_discs_underfoot_do_not_haze_the_sky(visit, page_of):
    # Discs of deviation 0.35 half a unit below the eye: drawn by their own tangent plane alone they reach the zenith.
    with served(page_of(Ground(discs=8, levels=1))) as address:
        picture = visit().open(f"{address}?still").at(x=2.0, y=2.0, eye=0.5, yaw=60, pitch=-5) / 255
    # 60 degrees are 320 pixels wide: the horizon is 277 tan 5 degrees = 24 rows above the middle, far tiles are thinner
    sky = picture[:70]
    assert (sky[..., 2] > sky[..., 0]).all()
    least = np.minimum(*(np.array(bundles.SKY[key]) for key in ("horizon", "zenith")))
    assert (sky >= least - 1.6 / 255).all()


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
