"""What the page draws: ground where ground is, sky above it, no holes, and the same picture for everybody."""

import json

import numpy as np
import pytest
from fixtures import bundles
from fixtures.bundles import Ground, colour_of

from dav_gswt.study.terrain.browser import served
from dav_gswt.terrain.choice import tile_at

SIDE, SALT = Ground().side, Ground().salt
OBLIQUE = dict(x=3.0, y=5.0, eye=2.0, yaw=20.0, pitch=-30.0)
MAGENTA = (255, 0, 255)


@pytest.fixture(scope="session")
def behind_magenta(page_of):
    """A page whose far ground and sky are magenta: it shines through every hole."""
    folder = page_of(Ground())
    manifest = json.loads((folder / "davgswt.json").read_text())
    pink = [v / 255 for v in MAGENTA]
    manifest |= {"ground_colour": pink, "sky": {"zenith": pink, "horizon": pink}}
    (folder / "davgswt.json").write_text(json.dumps(manifest))
    with served(folder) as address:
        yield address


def through(picture) -> np.ndarray:
    """How much magenta shows, 0 to 1: tiles hold at most 60 of 255 in blue, of which this is the excess."""
    return np.clip((picture[..., 2] - 60) / 195, 0, 1)


def test_each_tile_shows_its_colour_where_the_hash_puts_it(still, plain):
    seen = still(plain)
    for i, j in [(0, 0), (1, 0), (0, 1), (-1, -1), (-3, 2), (250, -1000)]:
        picture = seen.at(x=(i + 0.5) * SIDE, y=(j + 0.5) * SIDE, eye=1.0, yaw=90, pitch=-90)
        # one tile fills the picture (1.15 of 4 units wide). Gaps between its discs let at most 2 of 255 of the far
        # ground through, blending rounds some 10 times by half a step
        assert np.abs(picture - colour_of(tile_at(i, j, SALT, 1))).max() <= 6


def test_east_is_right_and_north_is_up_when_one_faces_north(still, plain):
    picture = still(plain).at(x=0.0, y=0.0, eye=3.0, yaw=90, pitch=-90)
    height, width, _ = picture.shape
    for i, row in ((-1, "left"), (0, "right")):
        for j in (-1, 0):
            # cell (0, 0) lies north-east of the corner in the middle; look a third of the way to the picture's corner
            y, x = height // 2 - (j * 2 + 1) * height // 4, width // 2 + (i * 2 + 1) * width // 4
            expected = colour_of(tile_at(i, j, SALT, 1))
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
        pytest.param(dict(x=1.0, y=1.0, eye=0.5, pitch=-40), id="near"),
        pytest.param(OBLIQUE, id="oblique"),
        pytest.param(dict(x=0.0, y=0.0, eye=12.0, pitch=-90), id="from above"),
        pytest.param(dict(x=51234.5, y=-70000.25, eye=2.0, pitch=-30, yaw=200), id="kilometres out"),
    ],
)
def test_the_ground_has_no_holes(still, behind_magenta, place):
    picture = still(behind_magenta).at(**place)
    # discs of opacity 250/255 whose deviation is 0.7 of their spacing overlap so much that less than 3 % is let through
    assert through(picture).max() < 0.03


@pytest.mark.parametrize("budget", [2_500, 1_500, 1_000])
def test_a_small_budget_draws_coarser_ground_and_no_holes(still, behind_magenta, budget):
    seen = still(behind_magenta)
    seen.page.evaluate("place => davgswt.set(place)", dict(x=2.0, y=2.0, eye=1.0, yaw=60, pitch=-25))
    picture = seen.picture(budget)
    state = seen.state
    assert 0.3 * budget < state["count"] <= budget
    # the lower half of the picture is less than two tile sides away
    assert through(picture[100:]).max() < 0.03
    assert state["reach"] > 3 * SIDE


def test_the_hole_test_would_see_a_hole(visit, page_of):
    folder = page_of(Ground())
    manifest = json.loads((folder / "davgswt.json").read_text())
    manifest |= {"ground_colour": [1, 0, 1]}
    for chunk in [c for tile in manifest["tiles"] for c in tile["chunks"]]:
        path = folder / chunk["file"]
        data = bytearray(path.read_bytes())
        data[15 : 16 * chunk["count"] : 16] = bytes(chunk["count"])  # opacity 0
        path.write_bytes(data)
        del chunk["sha256"]
    (folder / "davgswt.json").write_text(json.dumps(manifest))
    with served(folder) as address:
        assert through(visit().open(f"{address}?still").at(**OBLIQUE)).min() == 1


def test_two_visits_see_the_same_bits(visit, plain):
    pictures = [visit().open(f"{plain}?still").at(**OBLIQUE) for _ in range(2)]
    assert (pictures[0] == pictures[1]).all()
    assert pictures[0].std() > 10


def test_a_link_brings_another_person_to_the_same_place(visit, still, plain):
    first = still(plain)
    expected = first.at(**OBLIQUE)
    other = visit().open(f"{plain}?still#3,5,2,20,-30")
    assert {k: other.state[k] for k in OBLIQUE} == OBLIQUE
    assert (other.picture() == expected).all()


def test_two_to_the_32_cells_out_the_same_tiles_give_the_same_bits(still, plain):
    # The hash repeats after 2^32 cells, and 2^32 cells of side 4 are a distance that doubles hold exactly.
    seen = still(plain)
    near = seen.at(**OBLIQUE)
    far = seen.at(**OBLIQUE | {"x": OBLIQUE["x"] + 2**32 * SIDE, "y": OBLIQUE["y"] - 2**32 * SIDE})
    assert (near == far).all()


def test_a_step_kilometres_out_moves_the_picture_as_much_as_a_step_at_home(visit, page_of):
    # Were positions single precision, a step of 1 mm would be lost at 2^34 units, where floats are 2048 units apart.
    with served(page_of(Ground(speckle=30))) as address:
        seen = visit().open(f"{address}?still")
        changes = []
        for x in (3.0, 3.0 + 2**32 * SIDE):
            before = seen.at(**OBLIQUE | {"x": x})
            changes.append(seen.at(**OBLIQUE | {"x": x + 2**-6}) - before)
    assert np.abs(changes[0]).max() > 0
    assert (changes[0] == changes[1]).all()


def test_coarser_levels_are_drawn_farther_away(still, plain):
    seen = still(plain)
    seen.at(x=2.0, y=2.0, eye=1.0, yaw=0, pitch=-10)
    levels = {(cell["i"], cell["j"]): cell["level"] for cell in seen.state["drawn"]}
    # level 0 is used nearer than 2 sides (8 units): cell (1, 0) begins 2 units away, cell (3, 0) 10
    assert levels[1, 0] == 0 and levels[3, 0] == 1


def test_each_tile_keeps_the_order_of_its_own_direction(still, plain):
    seen = still(plain)
    seen.at(x=2.0, y=2.0, eye=0.5, yaw=0, pitch=0)
    orders = {(cell["i"], cell["j"]): cell["order"] for cell in seen.state["drawn"]}
    assert orders[5, 0] == 0, "eastwards along +x"
    assert orders[0, 0] == orders[1, 1] == 255, "the 3 x 3 about the eye are sorted exactly"
    slanted = bundles.directions()[6]  # (-1, 1, -sqrt 2)
    seen.at(x=2.0 + 4 * SIDE, y=2.0 - 4 * SIDE, eye=4 * SIDE * np.sqrt(2), yaw=135, pitch=-45)
    assert np.allclose(slanted * 2, [-1, 1, -np.sqrt(2)])
    assert {(c["i"], c["j"]): c["order"] for c in seen.state["drawn"]}[0, 0] == 6


def test_discs_underfoot_do_not_haze_the_sky(visit, page_of):
    # Discs of deviation 0.35 half a unit below the eye: drawn by their own tangent plane alone they reach the zenith.
    with served(page_of(Ground(discs=8, levels=1))) as address:
        picture = visit().open(f"{address}?still").at(x=2.0, y=2.0, eye=0.5, yaw=60, pitch=-5) / 255
    # 60 degrees are 320 pixels wide: the horizon is 277 tan 5 degrees = 24 rows above the middle, far tiles are thinner
    sky = picture[:70]
    assert (sky[..., 2] > sky[..., 0]).all()
    least = np.minimum(*(np.array(bundles.SKY[key]) for key in ("horizon", "zenith")))
    assert (sky >= least - 1.6 / 255).all()
