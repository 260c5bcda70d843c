"""Walking: keys, mouse, touch, the eye's floor, the link, and what survives a resize or a lost context."""

import pytest
from fixtures.bundles import Ground
from fixtures.page_visit import Visit

OBLIQUE = dict(x=3.0, y=5.0, eye=2.0, yaw=20.0, pitch=-30.0)


@pytest.fixture(scope="module")
def moving(chromium, plain):
    """A visit to a page that draws by itself."""
    with chromium.new_context(viewport={"width": 160, "height": 100}) as context:
        yield Visit(context.new_page()).open(plain)


def test_a_walk_changes_the_place_and_coming_back_shows_the_same_picture(visit, plain):
    seen = visit().open(plain)
    before = seen.at(**OBLIQUE)
    seen.page.keyboard.down("w")
    seen.until("davgswt.state.x > 3.2")
    seen.page.keyboard.up("w")
    away = seen.state
    # yaw 20 degrees: the walk goes east by cos 20 and north by sin 20 of it
    assert (away["y"] - 5) / (away["x"] - 3) == pytest.approx(0.36397, abs=1e-4)
    assert (seen.picture() != before).any()
    assert (seen.at(**OBLIQUE) == before).all()


@pytest.mark.parametrize(
    "key, condition",
    [
        ("s", "s.x < 2.9 && s.y < 5"),
        ("a", "s.y > 5.1 && s.x < 3"),
        ("d", "s.y < 4.9 && s.x > 3"),
        ("ArrowUp", "s.x > 3.1"),
        ("ArrowLeft", "s.yaw > 22"),
        ("ArrowRight", "s.yaw < 18"),
        ("e", "s.eye > 2.1"),
        ("q", "s.eye < 1.9"),
    ],
)
def test_each_key_does_what_the_help_says(moving, key, condition):
    moving.at(**OBLIQUE)
    moving.page.keyboard.down(key)
    moving.until(f"(s => {condition})(davgswt.state)")
    moving.page.keyboard.up(key)


def test_the_eye_stays_above_its_floor(visit, plain):
    seen = visit(160, 100).open(f"{plain}?still#2,2,0.001,0,-20")
    assert seen.state["eye"] == Ground().eye_floor
    seen.at(eye=-5)
    assert seen.state["eye"] == Ground().eye_floor
    seen.page.mouse.move(80, 20)  # above the tools
    for _ in range(3):
        seen.page.mouse.wheel(0, -200)
    assert seen.state["eye"] == Ground().eye_floor
    seen.page.mouse.wheel(0, 200)
    seen.until(f"davgswt.state.eye > 1.3 * {Ground().eye_floor}")


def test_dragging_turns_the_view_as_if_the_picture_were_held(visit, plain):
    seen = visit().open(f"{plain}?still")
    seen.at(**OBLIQUE)
    seen.page.mouse.move(100, 20)  # above the tools
    seen.page.mouse.down()
    seen.page.mouse.move(140, 40)
    seen.page.mouse.up()
    # 320 pixels are 60 degrees: 40 pixels to the right are 7.5 degrees to the left, 20 down are 3.75 up
    assert (seen.state["yaw"], seen.state["pitch"]) == (pytest.approx(27.5), pytest.approx(-26.25))


def test_a_phone_has_a_pad_to_walk_with(visit, plain):
    seen = visit(390, 844, has_touch=True, is_mobile=True).open(plain)
    pad = seen.page.get_by_role("button", name="Hold to walk forward")
    assert pad.is_visible()
    before = seen.state["y"]
    pad.dispatch_event("pointerdown", {"pointerId": 1, "bubbles": True})
    seen.until(f"davgswt.state.y > {before} + 0.02")
    assert seen.page.evaluate("document.documentElement.scrollWidth <= innerWidth")


def test_the_address_follows_the_walk_and_a_pasted_one_is_followed(visit, plain):
    seen = visit(160, 100).open(plain)
    seen.at(**OBLIQUE)
    seen.until("location.hash.startsWith('#3.0000,5.0000,2.0000,20.000,-30.000')")
    seen.page.evaluate("location.hash = '#-7,1.5,1,90,-10'")
    seen.until("davgswt.state.x === -7 && davgswt.state.yaw === 90")


def test_the_address_names_the_overlay_and_a_pasted_one_shows_it(visit, plain):
    seen = visit(160, 100).open(f"{plain}#3,5,2,20,-30&show=level")
    assert seen.state["overlay"] == "level"
    seen.page.keyboard.press("o")
    seen.until("location.hash.endsWith('&show=order')")
    seen.page.evaluate("location.hash = '#-7,1.5,1,90,-10&show=tile&paint='")
    seen.until("davgswt.state.x === -7 && davgswt.state.overlay === 'tile'")
    seen.page.evaluate("location.hash = '#3,5,2,20,-30'")
    seen.until("davgswt.state.x === 3 && davgswt.state.overlay === 'picture'")


def test_an_address_that_is_entered_as_the_page_writes_its_own_is_followed(visit, plain):
    seen = visit(160, 100)
    seen.page.add_init_script("""window.ticks = [];
        const start = window.setInterval;
        window.setInterval = (tick, ...rest) => { ticks.push(tick); return start(tick, ...rest); };""")
    seen.open(plain)
    seen.page.evaluate("""() => {
        davgswt.set({ x: 3, y: 5 });
        location.hash = "#-7,1.5,1,90,-10";
        for (const tick of ticks) tick();
    }""")
    seen.until("davgswt.state.x === -7", 5.0)


@pytest.mark.parametrize("name", ["picture", "nothing", "%", ""])
def test_an_address_of_no_overlay_shows_the_terrain(visit, plain, name):
    assert visit(160, 100).open(f"{plain}?still#3,5,2,20,-30&show={name}").state["overlay"] == "picture"


def test_a_link_with_nonsense_starts_at_the_usual_place(visit, plain):
    usual = visit(160, 100).open(f"{plain}?still").state
    state = visit(160, 100).open(f"{plain}?still#one,,NaN,Infinity").state
    assert state == usual


def test_a_resized_window_is_filled(visit, plain):
    seen = visit().open(f"{plain}?still")
    seen.page.set_viewport_size({"width": 200, "height": 300})
    seen.until("document.getElementById('picture').height === 300")
    assert seen.at(**OBLIQUE).shape == (300, 200, 3)


def test_a_lost_context_comes_back_with_the_same_picture(visit, plain):
    seen = visit().open(f"{plain}?still")
    before = seen.at(**OBLIQUE)
    seen.page.evaluate(
        """() => {
          const gl = document.getElementById("picture").getContext("webgl2");
          window.loss = gl.getExtension("WEBGL_lose_context");
          loss.loseContext();
        }"""
    )
    error = seen.page.locator("#error")
    error.wait_for(state="visible")
    seen.page.evaluate("loss.restoreContext()")
    error.wait_for(state="hidden")
    assert (seen.picture() == before).all()


@pytest.mark.parametrize("overlay", ["picture", "level"])
def test_a_picture_waits_for_a_context_that_is_lost_meanwhile(visit, plain, overlay):
    seen = visit(160, 100).open(f"{plain}?still")
    seen.page.evaluate("name => davgswt.overlay(name)", overlay)
    before = seen.at(**OBLIQUE)
    seen.page.evaluate(
        """() => {
          const gl = document.getElementById("picture").getContext("webgl2");
          const loss = gl.getExtension("WEBGL_lose_context");
          davgswt.settle(); // under way when the context goes
          loss.loseContext();
          setTimeout(() => loss.restoreContext(), 200);
        }"""
    )
    assert (seen.picture() == before).all()


def test_the_budget_takes_fewer_splats_and_still_draws_near_tiles_back_to_front(modules):
    result = modules.evaluate(
        """async () => {
          const { createTerrainTables } = await import("./worker/terrain_tables.js");
          const { selectCells } = await import("./terrain/budget.js");
          const { createHeights } = await import("./terrain/heights.js");
          const { cameraAt } = await import("./terrain/camera.js");
          const { createWalker } = await import("./ui/walker.js");
          const manifest = await (await fetch("davgswt.json")).json();
          const terrain = createTerrainTables(manifest, createHeights());
          for (const tile of terrain.tiles) tile.arrived = (1 << manifest.levels.length) - 1;
          const camera = cameraAt(createWalker(manifest, { eye: 1, pitch: -10 }), 1280, 720);
          return [1e9, 20000, 5000, 300].map(budget => {
            const { cells, count, reach } = selectCells(terrain, camera, budget);
            return { budget, count, reach, cells: cells.map(({ di, dj }) => [di, dj]),
              steps: cells.map(({ di, dj }) => Math.abs(di) + Math.abs(dj)) };
          });
        }"""
    )
    assert result[0]["count"] > 20000
    for now, tighter in zip(result, result[1:], strict=False):
        assert tighter["count"] <= tighter["budget"]
        assert tighter["count"] > 0.5 * tighter["budget"], "the budget is used"
        assert tighter["reach"] <= now["reach"]
    for each in result:
        assert each["steps"] == sorted(each["steps"], reverse=True)
        assert len({tuple(cell) for cell in each["cells"]}) == len(each["cells"])
        assert min(each["steps"]) == 0, "the tile underfoot is drawn"
