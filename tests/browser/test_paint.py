"""Painted materials: strokes, history, settings, links and files; and on the page the brush, panel and overlay."""

import json

import numpy as np
import pytest
from fixtures.browser import served
from fixtures.dropped_files import drop
from fixtures.land_covers import SIDE
from fixtures.page_visit import VIEWER, camera_at
from fixtures.paint_pages import ABOVE, BLANK, PIXEL, SPREAD, THINGS, WALKER, is_grass, paint, places_of

from dav_gswt.bundle.manifest import Manifest
from dav_gswt.bundle.store import Bundle
from dav_gswt.files import read_json
from dav_gswt.terrain import endless, stills
from dav_gswt.terrain.heights import Hills
from dav_gswt.terrain.page import write_page

slow = pytest.mark.slow
PAINTING = """
  const { createPainting } = await import("./ui/painting.js");
  const { describePaint, readPaint } = await import("./data/paint.js");
  const { decodePaint, encodePaint } = await import("./data/paint.js");
  const sent = [], client = { paint: points => sent.push([...points]), adjust: change => sent.push(change) };
  const painting = createPainting(manifest, client, () => {});
  const stroke = (...dabs) => {
    painting.begin();
    const said = dabs.map(dab => painting.dab(...dab));
    painting.end();
    return said;
  };
"""


@pytest.fixture(scope="module")
def manifest(cover):
    return read_json(cover / "page/davgswt.json")


def run(modules, manifest, act: str):
    """The result of a function's body after `PAINTING`."""
    return modules.evaluate("async manifest => {" + PAINTING + act + "}", manifest)


def test_a_stroke_paints_the_points_within_the_radius_and_is_one_step(modules, manifest):
    act = """
      const said = stroke([4, 7, 1.1, 1], [4.5, 7, 1.1, 0]), after = painting.paint.runs;
      painting.undo();
      const undone = painting.painted.count;
      painting.redo();
      painting.begin();
      painting.dab(4, 7, 3, 1);
      painting.cancel();
      return { said, after, undone, redone: painting.paint.runs, sent: sent.map(points => points.length / 3) };
    """
    found = run(modules, manifest, act)
    step, wanted = SIDE / 8, {}
    for x, material in ((4.0, 1), (4.5, 0)):
        for i in range(30):
            for j in range(30):
                if np.hypot(i * step - x, j * step - 7) <= 1.1:
                    wanted[i, j] = material
    assert {(i + k, j): m for i, j, length, m in found["after"] for k in range(length)} == wanted
    assert found["said"] == [None, None] and found["undone"] == 0 and found["redone"] == found["after"]
    assert found["sent"][2] == found["sent"][3] == len(wanted)


def test_no_more_is_painted_than_the_page_keeps(modules, manifest):
    act = """
      const runs = Array.from({ length: 2 ** 9 - 1 }, (_, j) => [0, j, 2 ** 9, 0]);
      painting.load({ runs, densities: [1], offsets: [0, 0] });
      return [painting.dab(-300, -300, 30, 1), painting.painted.count, painting.dab(1e9, 0, 1, 1)];
    """
    assert run(modules, manifest, act) == ["full", 2**18, "far"]


def test_links_and_files_restore_what_was_painted_and_set(modules, manifest):
    act = """
      const blank = await encodePaint(painting.paint, manifest);
      stroke([4, 7, 3, 1]);
      stroke([-9, -3, 1, 0]);
      painting.setDensity(0, 2, true);
      painting.load({ ...painting.paint, offsets: [0.03, -0.03] });
      const { paint } = painting, link = await encodePaint(paint, manifest);
      const file = JSON.parse(JSON.stringify(describePaint(paint, manifest)));
      const other = { ...manifest, materials: manifest.materials.toReversed() };
      return { paint, link, blank, back: [await decodePaint(link, manifest), readPaint(file, manifest)],
        turned: readPaint(file, other), told: await decodePaint(link, other).catch(error => error.message) };
    """
    found = run(modules, manifest, act)
    assert found["back"] == [found["paint"]] * 2
    assert len(found["blank"]) < len(found["link"]) < 400 and len(found["paint"]["runs"]) > 10
    assert [run[3] for run in found["turned"]["runs"]] == [1 - run[3] for run in found["paint"]["runs"]]
    assert found["turned"]["offsets"] == [-0.03, 0.03] and "of another terrain" in found["told"]


@pytest.mark.parametrize("link", ["AAAA", "a" * 20_000, "%00<b>", ""], ids=["cut", "long", "letters", "none"])
def test_a_broken_link_is_refused(modules, manifest, link):
    act = f"return decodePaint({json.dumps(link)}, manifest).then(() => null, error => error.message);"
    assert "cut short or changed" in run(modules, manifest, act)


@pytest.mark.parametrize(
    "change, message",
    [
        ({"format": "x"}, "holds no painted materials"),
        ({"version": 7}, "version 7"),
        ({"materials": ["sand", 3]}, "“materials”"),
        ({"runs": {}}, "“runs”"),
        ({"runs": [[0, 0, 1]]}, "“runs”"),
        ({"runs": [[0, 0.5, 1, 0]]}, "“runs”"),
        ({"runs": [[0, 0, 0, 0]]}, "“runs”"),
        ({"runs": [[2**23 - 1, 0, 1, 0]]}, "“runs”"),
        ({"runs": [[0, -(2**23), 1, 0]]}, "“runs”"),
        ({"runs": [[0, k, 2**17 + 1, 0] for k in range(2)]}, "“runs”"),
        ({"runs": [[0, 0, 1, 2]]}, "“runs”"),
        ({"densities": {"shrub": -1}}, "“densities”"),
        ({"densities": []}, "“densities”"),
        ({"offsets": {"sand": 99}}, "“offsets”"),
        ({"materials": ["mud", "grass"], "runs": [[0, 0, 1, 0]]}, "“mud”"),
    ],
    ids=lambda value: str(value)[:40],
)
def test_a_bad_file_is_refused(modules, manifest, change, message):
    act = f"try {{ readPaint({json.dumps(BLANK | change)}, manifest); }} catch (error) {{ return error.message; }}"
    assert message in run(modules, manifest, act)


def test_a_dab_changes_the_picture_there_and_nowhere_else_and_undo_restores_it(seen):
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
    seen.page.evaluate("davgswt.painting.undo()")
    assert (seen.picture() == before).all()


@slow
def test_a_stroke_of_the_mouse_while_the_page_draws_shows_what_a_link_to_it_shows(visit, address):
    moving = visit(240, 240).open(address)
    moving.at(**ABOVE)
    moving.page.evaluate("davgswt.paint.brush.material = 1")
    moving.page.mouse.move(60, 120)
    moving.page.mouse.down()
    moving.page.mouse.move(180, 120, steps=12)
    moving.page.mouse.up()
    painted = moving.picture()
    east, north = places_of(painted)
    way = (np.abs(north - ABOVE["y"]) < 0.5) & (np.abs(east - ABOVE["x"]) < 50 * PIXEL)
    assert is_grass(painted)[way].mean() > 0.97
    assert moving.state["yaw"] == ABOVE["yaw"], "the view is not turned"
    moving.until("location.hash.includes('&paint=')")
    link = moving.page.evaluate("location.hash")
    moving.page.evaluate("davgswt.painting.undo()")
    assert moving.page.evaluate("davgswt.painting.painted.count") == 0
    moving.until("!location.hash.includes('paint')")
    fresh = visit(240, 240).open(f"{address}?still{link}")
    assert (fresh.picture() == painted).all() and not fresh.page.evaluate("davgswt.painting.canUndo")
    broken = visit(120, 80).open(f"{address}?still#1,1,2,0,-20&paint=AAAA")
    assert "cut short or changed" in broken.page.get_by_role("alert").inner_text() and broken.state["loaded"]


@slow
def test_keys_choose_a_brush_and_paint_under_it_and_sliders_set_densities(visit, address):
    seen = visit(400, 400).open(f"{address}?still")
    seen.at(**ABOVE)
    for key in ("m", "2", "Space"):
        seen.page.keyboard.press(key)
    points = seen.page.evaluate("davgswt.painting.painted.points()")
    assert {material for _, _, material in points} == {1}
    i, j = np.mean([point[:2] for point in points], 0) * SIDE / 8
    assert abs(i - ABOVE["x"]) < 0.3 and abs(j - ABOVE["y"]) < 0.3
    assert seen.page.locator("#brush polygon").first.get_attribute("points").count(",") == 64
    seen.page.keyboard.press("Control+z")
    seen.page.keyboard.press("Escape")
    assert seen.page.evaluate("davgswt.painting.painted.count") == 0 and not seen.page.locator("#brush").is_visible()
    before = seen.picture()
    seen.page.locator("#densities [type=range]").focus()
    seen.page.keyboard.press("ArrowRight")
    assert seen.page.evaluate("davgswt.painting.densities[0]") == 1.05 and seen.state["yaw"] == ABOVE["yaw"]
    drag = "one => { one.value = '0'; for (const kind of ['input', 'change'])"
    drag += " one.dispatchEvent(new Event(kind, { bubbles: true })); }"
    seen.page.locator("#densities [type=range]").evaluate(drag)
    dark = [int((picture[..., 1] < 105).sum()) for picture in (before, seen.picture())]
    assert dark[1] < 0.1 * dark[0], "no shrubs, no gaps"
    for _ in range(2):
        seen.page.evaluate("document.getElementById('undo').click()")
    assert (seen.picture() == before).all()
    seen.page.keyboard.press("Escape")
    assert not seen.page.locator("#paint").is_visible()


@slow
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


@slow
def test_stills_and_pages_show_what_was_painted_set_and_saved(cover, tmp_path, seen, still):
    """The saved file in the config: the library's picture, and a page that begins with it, are those painted on."""
    seen.at(**ABOVE)
    paint(seen, 4.0, 7.0, 3.0, 1)
    paint(seen, 8.0, 2.0, 2.0, 0)
    seen.page.evaluate("davgswt.painting.setDensity(0, 2, true)")
    seen.page.evaluate("davgswt.painting.load({ ...davgswt.painting.paint, offsets: [0.03, -0.03] })")
    with seen.page.expect_download() as download:
        seen.page.locator("#savePaint").dispatch_event("click")
    download.value.save_as(tmp_path / "painted.json")
    painted, data = seen.picture(), (tmp_path / "painted.json").read_bytes()
    seen.page.evaluate("davgswt.painting.load(davgswt.painting.blank)")
    seen.page.set_input_files("#paintFile", {"name": "p.json", "mimeType": "application/json", "buffer": data})
    seen.until("davgswt.painting.painted.count > 0")
    assert (seen.picture() == painted).all()
    seen.page.evaluate("davgswt.painting.undo()")
    drop(seen, "p.json", data)
    seen.until("davgswt.painting.painted.count > 0")
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


@slow
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
