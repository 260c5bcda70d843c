"""Painted materials on the page: strokes, history, settings, and the overlay of materials."""

import numpy as np
from fixtures.land_covers import SIDE
from fixtures.page_visit import VIEWER, camera_at
from fixtures.paint_pages import ABOVE, BLANK, PIXEL, SPREAD, THINGS, WALKER, is_grass, paint, places_of

from dav_gswt.bundle.manifest import Manifest
from dav_gswt.bundle.store import Bundle
from dav_gswt.files import read_json, write_json
from dav_gswt.study.terrain.browser import served
from dav_gswt.terrain import endless, stills
from dav_gswt.terrain.heights import Hills
from dav_gswt.terrain.page import write_page


def test_a_dab_changes_the_picture_there_and_nowhere_else(seen):
    before = seen.at(**ABOVE)
    x, y, radius, material = 4.0, 7.0, 3.0, int(not is_grass(before[100, 100]))
    east, north = places_of(before)
    away = np.hypot(east - x, north - y)
    paint(seen, x, y, radius, material)
    after = seen.picture()
    inner = after[away < radius - SPREAD]
    assert (is_grass(inner) == bool(material)).mean() > 0.97, "but for pixels at the edges of shrubs"
    changed = (before != after).any(-1)
    assert changed[away < radius].mean() > 0.2
    assert not changed[away > radius + SPREAD + THINGS + 2 * PIXEL].any()


def test_undo_restores_the_picture_to_the_bit_and_redo_what_was_painted(seen):
    before = seen.at(**ABOVE)
    pictures = [before]
    for x, material in ((3.0, 1), (7.0, 0), (5.0, -1)):
        paint(seen, x, 5.0, 2.5, material)
        pictures.append(seen.picture())
    for step in reversed(range(3)):
        seen.page.evaluate("davgswt.painting.undo()")
        assert (seen.picture() == pictures[step]).all()
    for step in range(1, 4):
        seen.page.evaluate("davgswt.painting.redo()")
        assert (seen.picture() == pictures[step]).all()


def test_a_stroke_of_the_mouse_paints_along_its_way_and_is_one_step(seen):
    seen.at(**ABOVE)
    seen.page.evaluate("davgswt.paint.brush.material = 1")
    seen.page.mouse.move(60, 120)
    seen.page.mouse.down()
    seen.page.mouse.move(180, 120)
    seen.page.mouse.up()
    east, north = places_of(seen.picture())
    way = (np.abs(north - ABOVE["y"]) < 0.5) & (np.abs(east - ABOVE["x"]) < 50 * PIXEL)
    assert is_grass(seen.picture())[way].mean() > 0.97
    assert seen.state["yaw"] == ABOVE["yaw"], "the view is not turned"
    seen.page.evaluate("davgswt.painting.undo()")
    assert seen.page.evaluate("davgswt.painting.painted.count") == 0


def test_a_stroke_while_the_page_draws_by_itself_shows_what_is_shown_of_it_elsewhere(seen, visit, address):
    moving = visit(240, 240).open(address)
    moving.at(**ABOVE)
    moving.page.evaluate("davgswt.paint.brush.material = 1")
    moving.page.mouse.move(40, 90)
    moving.page.mouse.down()
    moving.page.mouse.move(200, 150, steps=12)
    moving.page.mouse.up()
    before = seen.at(**ABOVE)
    seen.page.evaluate("paint => davgswt.painting.load(paint)", moving.page.evaluate("davgswt.painting.paint"))
    assert (moving.picture() == seen.picture()).all() and (before != seen.picture()).any()


def test_keys_choose_a_brush_and_the_space_bar_paints_under_it(visit, address):
    seen = visit(240, 240).open(f"{address}?still")
    seen.at(**ABOVE)
    for key in ("m", "2", "]", "Space"):
        seen.page.keyboard.press(key)
    points = seen.page.evaluate("davgswt.painting.painted.points()")
    assert {material for _, _, material in points} == {1}
    i, j = np.mean([point[:2] for point in points], 0) * SIDE / 8
    assert abs(i - ABOVE["x"]) < 0.3 and abs(j - ABOVE["y"]) < 0.3
    assert seen.page.locator("#brush polygon").first.get_attribute("points").count(",") == 64
    seen.page.keyboard.press("Control+z")
    seen.page.keyboard.press("Escape")
    assert seen.page.evaluate("davgswt.painting.painted.count") == 0 and not seen.page.locator("#brush").is_visible()


def test_one_finger_paints_and_a_second_one_takes_it_back_and_walks(visit, address):
    seen = visit(240, 240, has_touch=True).open(f"{address}?still")
    seen.at(**ABOVE)
    seen.page.evaluate("davgswt.paint.brush.material = 1")
    session = seen.page.context.new_cdp_session(seen.page)

    def touch(kind, *points):
        touches = [{"x": x, "y": y, "id": k} for k, (x, y) in enumerate(points)]
        session.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": touches})

    touch("touchStart", (120, 120))
    touch("touchMove", (140, 120))
    assert (first := seen.page.evaluate("davgswt.painting.painted.count")) > 0
    touch("touchStart", (140, 120), (60, 60))
    assert seen.page.evaluate("davgswt.painting.painted.count") == 0
    touch("touchMove", (160, 140), (80, 80))
    touch("touchEnd")
    assert seen.state["x"] != ABOVE["x"] and seen.page.evaluate("davgswt.painting.painted.count") == 0
    touch("touchStart", (120, 120))
    touch("touchEnd")
    assert 0 < seen.page.evaluate("davgswt.painting.painted.count") <= first


def test_no_more_is_painted_than_the_page_keeps(seen):
    runs = [[0, j, 2**9, 0] for j in range(2**9 - 1)]
    seen.page.evaluate("paint => davgswt.paint.keep.load(paint)", BLANK | {"runs": runs})
    answer = seen.page.evaluate("davgswt.painting.dab(-300, -300, 30, 1)")
    assert answer == "full" and seen.page.evaluate("davgswt.painting.painted.count") == 2**18
    assert seen.page.evaluate("davgswt.painting.dab(1e9, 0, 1, 1)") == "far"


def test_the_overlay_shows_the_material_of_every_place_and_names_its_colours(seen):
    plain = seen.at(**ABOVE)
    seen.page.select_option("#overlay", "material")
    shown = seen.picture()
    assert seen.page.locator("#legend li").all_inner_texts() == ["sand", "grass", "objects"]
    read = "all => all.map(one => getComputedStyle(one).backgroundColor.match(/\\d+/g).map(Number))"
    colours = np.array(seen.page.locator("#legend .swatch").evaluate_all(read))
    away = np.linalg.norm(shown[:, :, None] - colours, axis=-1)
    nearest, shrub = away.argmin(-1), plain[..., 1] < 105
    assert (shrub & (nearest == 2)).sum() > 50, "shrubs are dark green"
    grass = is_grass(plain)
    clear = (np.abs(plain[..., 0] - plain[..., 1]) > 25) & ~shrub & (nearest < 2)
    assert clear.mean() > 0.4 and (nearest[clear] == grass[clear]).mean() > 0.95
    seen.page.select_option("#overlay", "picture")
    assert not seen.page.locator("#legend").is_visible() and (seen.picture() == plain).all()


def test_the_overlay_is_right_for_tiles_beyond_255(cover, tmp_path, visit):
    """Each material has 256 tiles, by the same files sixteen times; numbers of grass have nine bits."""
    write_page(cover / "bundle", VIEWER, tmp_path / "page")
    manifest = read_json(tmp_path / "page/davgswt.json")
    tiles = [tile for first in (0, 16) for _ in range(16) for tile in manifest["tiles"][first : first + 16]]
    manifest["tiles"] = [tile | {"tile": number} for number, tile in enumerate(tiles)]
    manifest["materials"][1]["first_tile"] = 256
    write_json(tmp_path / "page/davgswt.json", manifest)
    with served(tmp_path / "page") as address:
        seen = visit(120, 120).open(f"{address}?still")
        plain = seen.at(**ABOVE)
        seen.page.select_option("#overlay", "material")
        shown = seen.picture()
    orange = shown[..., 0] > shown[..., 2] + 60
    clear = np.abs(plain[..., 0] - plain[..., 1]) > 25
    assert (orange != is_grass(plain))[clear].mean() > 0.95


def test_a_density_of_zero_removes_the_objects_and_more_adds_some(seen):
    seen.page.evaluate("davgswt.overlay('material')")
    counts = {}
    for factor in (1, 0, 3, 1):
        seen.page.evaluate("factor => davgswt.painting.setDensity(0, factor, true)", factor)
        picture = seen.at(**ABOVE)
        counts.setdefault(factor, []).append(int((picture.min(-1) > 150).sum()))
    assert counts[0] == [0] and counts[1][0] == counts[1][1] > 50 and counts[3][0] > 1.5 * counts[1][0]


def test_sliders_set_densities_and_shares_and_are_undone(visit, address):
    seen = visit(240, 240).open(f"{address}?still")
    before = seen.at(**ABOVE)
    seen.page.evaluate("document.getElementById('paintButton').click()")
    for slider, value in (("#densities input", "0"), ("#shares input", "0")):
        change = "(one, value) => { one.value = value; for (const kind of ['input', 'change'])"
        change += " one.dispatchEvent(new Event(kind, { bubbles: true })); }"
        seen.page.locator(slider).first.evaluate(change, value)
    assert seen.page.evaluate("davgswt.painting.densities") == [0]
    assert is_grass(seen.picture()).all(), "no sand and no gaps where shrubs were"
    assert seen.page.locator("#shares output").all_text_contents() == ["0 %", "100 %"]
    for _ in range(2):
        seen.page.evaluate("document.getElementById('undo').click()")
    assert (seen.picture() == before).all()
    assert seen.page.locator("#densities output").text_content() == "1.00×"


def test_escape_drops_the_brush_and_then_closes_the_panel(visit, address):
    seen = visit(900, 700).open(f"{address}?still")
    for key, painting, shown in (
        ("m", False, True),
        ("2", True, True),
        ("Escape", False, True),
        ("Escape", False, False),
    ):
        seen.page.keyboard.press(key)
        assert seen.page.evaluate("document.documentElement.classList.contains('painting')") == painting
        assert seen.page.locator("#paint").is_visible() == shown


def test_arrow_keys_on_a_slider_move_it_and_not_the_walker(visit, address):
    seen = visit(900, 700).open(f"{address}?still")
    seen.page.keyboard.press("m")
    seen.page.locator("#densities input").focus()
    yaw = seen.state["yaw"]
    seen.page.keyboard.press("ArrowRight")
    assert seen.page.evaluate("davgswt.painting.densities[0]") == 1.05
    assert seen.page.evaluate("davgswt.painting.canUndo") and seen.state["yaw"] == yaw


def test_where_other_terms_fix_places_there_are_no_sliders_of_shares(cover, tmp_path, visit):
    rule = [{"kind": "noise"}, {"kind": "height", "material": "grass", "low": 0.0, "soft": 0.5}]
    write_page(cover / "bundle", VIEWER, tmp_path / "page", Hills(2.0, 40.0, 3, 5), rule)
    with served(tmp_path / "page") as address:
        seen = visit(600, 600).open(f"{address}?still")
        seen.page.keyboard.press("m")
        seen.page.locator("#shareBox summary").click()
        assert "cannot be set here" in seen.page.locator("#noShares").inner_text()
        assert seen.page.locator("#shares input").count() == 0


def test_stills_show_what_was_painted_and_set(cover, tmp_path, seen, still):
    """The saved file in the config: the library's picture, and a page that begins with it, are those painted on."""
    seen.at(**ABOVE)
    paint(seen, 4.0, 7.0, 3.0, 1)
    paint(seen, 8.0, 2.0, 2.0, 0)
    seen.page.evaluate("davgswt.painting.setDensity(0, 2, true)")
    seen.page.evaluate("davgswt.painting.setOffsets([0.03, -0.03], true)")
    with seen.page.expect_download() as download:
        seen.page.locator("#savePaint").dispatch_event("click")
    download.value.save_as(tmp_path / "painted.json")
    rule = [{"kind": "noise"}, {"kind": "painted", "file": str(tmp_path / "painted.json")}]
    write_page(cover / "bundle", VIEWER, tmp_path / "page", None, rule)
    with served(tmp_path / "page") as address:
        begun = still(address, 240, 240)
        assert (begun.at(**ABOVE) == seen.picture()).all()
        assert begun.page.evaluate("davgswt.paint.keep.findLink()") == ""
    manifest = Manifest.from_dict(read_json(cover / "page/davgswt.json"))
    terrain = endless.terrain_from_bundle(Bundle(cover / "page", manifest), {"kind": "flat"}, rule)
    camera = camera_at(terrain, WALKER)
    expected = np.rint(255 * stills.render_view(terrain, camera, manifest.sky, manifest.ground_colour))
    seen.page.set_viewport_size({"width": 160, "height": 100})
    difference = np.abs(seen.at(**WALKER) - expected)
    seen.page.set_viewport_size({"width": 240, "height": 240})
    assert difference.mean() < 1.0 and difference.max() <= 32


def test_a_terrain_of_one_material_has_no_panel(still, plain):
    assert not still(plain, 160, 100).page.locator("#paintButton").is_visible()


def test_on_hills_the_brush_paints_what_is_seen_under_it(cover, tmp_path, visit):
    hills = Hills(1.5 * SIDE, 12.0 * SIDE, 3, 5)
    write_page(cover / "bundle", VIEWER, tmp_path / "page", hills)
    with served(tmp_path / "page") as address:
        seen = visit(240, 160).open(f"{address}?still")
        seen.at(x=6.0, y=5.0, eye=3.0, yaw=30.0, pitch=-25.0)
        seen.page.evaluate("davgswt.paint.brush.material = 1")
        seen.page.mouse.click(70, 60)
        points = np.array(seen.page.evaluate("davgswt.painting.painted.points()"))
    place = points[:, :2].mean(0) * SIDE / 8
    (ground, foot), _ = hills.at(*np.stack([place, [6.0, 5.0]]).T)
    # angles to the place, seen from the eye: those of the pixel, turned by the camera's pitch and yaw
    pitch, yaw, across, up = np.radians(-25), np.radians(30), (70 - 120) / 120, (80 - 60) / 120
    ahead, rise = 1 / np.tan(np.radians(30)), np.array([np.cos(pitch), np.sin(pitch)])
    way = np.array([ahead * rise[0] - up * rise[1], -across, ahead * rise[1] + up * rise[0]])
    turned = np.array(
        [np.cos(yaw) * way[0] - np.sin(yaw) * way[1], np.sin(yaw) * way[0] + np.cos(yaw) * way[1], way[2]]
    )
    seen_at = np.array([*place - [6.0, 5.0], ground - foot - 3.0])
    distance = np.linalg.norm(seen_at)
    assert distance < 15
    np.testing.assert_allclose(seen_at / distance, turned / np.linalg.norm(turned), atol=SIDE / 16 / distance)


def test_only_cells_that_a_dab_touches_are_made_again(modules, cover):
    """Borders of other cells keep their identity, so their Gaussians are not tested again."""
    found = modules.evaluate(
        """async manifest => {
          const { createTerrainTables } = await import("./worker/terrain_tables.js");
          const { createHeights } = await import("./terrain/heights.js");
          const { lookUpCell } = await import("./terrain/cells.js");
          const { paintPoints } = await import("./worker/repaint.js");
          const terrain = createTerrainTables(manifest, createHeights());
          const borders = () => {
            const found = new Map();
            for (let j = -20; j < 20; j++) for (let i = -20; i < 20; i++) {
              found.set(`${i},${j}`, terrain.cache.border[lookUpCell(terrain, i, j)]);
            }
            return found;
          };
          const before = borders();
          paintPoints(terrain, Int32Array.of(20, 36, 1));
          const after = borders();
          return {
            borders: [...before.values()].filter(Boolean).length,
            changed: [...before].filter(([key, one]) => one !== after.get(key)).map(([key]) => key),
          };
        }""",
        read_json(cover / "page/davgswt.json"),
    )
    assert found["borders"] > 100
    assert set(found["changed"]) <= {"2,4"}
