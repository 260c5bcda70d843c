from dataclasses import replace

import numpy as np
import pytest
from fixtures import mixed_ground as made

from dav_gswt.errors import InputError
from dav_gswt.field import concatenate_fields
from dav_gswt.materials import build, extraction, store, verdict
from dav_gswt.materials.filling import CellSources
from dav_gswt.materials.objects import Footprint
from dav_gswt.reconstruction import top_view, underlay
from dav_gswt.reconstruction.objects import make_blobs


@pytest.fixture(scope="module")
def found():
    return build.find_materials(made.field(), made.grid(), 0)


def picture(material):
    return top_view.render_exemplar(material.field, material.grid).colour


@pytest.mark.parametrize(("number", "colour"), [(0, made.SAND), (1, made.GRASS)])
def test_an_exemplar_shows_its_material_alone(found, number, colour):
    away = np.abs(picture(found.materials[number]) - colour).max(-1)
    assert (away < 0.15).mean() > 0.99


def test_exemplars_have_a_disc_a_cell_and_an_underlay(found):
    for material in found.materials:
        grid, field = material.grid, material.field
        assert grid.shape == (grid.cells, grid.cells)
        assert field.ground.sum() == grid.cells**2
        assert underlay.find_rows(field, grid) == slice(grid.cells**2, grid.cells**2 + underlay.count_gaussians(grid))


def test_discs_lie_in_their_cells(found):
    grid, field = found.materials[0].grid, found.materials[0].field
    np.testing.assert_allclose(field.means[: grid.cells**2, :2], grid.centres[:, :2], atol=1e-5)


def test_no_shrub_is_left_on_the_ground(found):
    grid, field = found.materials[0].grid, found.materials[0].field
    assert len(field) == grid.cells**2 + underlay.count_gaussians(grid)


def test_filled_ground_is_marked_as_uncertain(found):
    field = found.materials[0].field
    assert field.uncertainty[field.ground].max() == pytest.approx(extraction.FILLED)
    assert found.materials[0].filled == pytest.approx(np.mean(field.uncertainty[field.ground] > 0), abs=1e-6)


def test_objects_stand_around_their_foot(found):
    for each in found.objects:
        assert np.abs(each.field.means[:, :2].mean(0)).max() < 2 * made.SPACING
        assert each.height == pytest.approx((made.HEIGHT - 2) * made.SPACING, abs=made.SPACING)
        assert each.radius == pytest.approx(made.RADIUS * made.SPACING, abs=3 * made.SPACING)


def test_density_counts_objects_on_the_area_of_their_material(found):
    area = found.classes.shares[0] * (~found.classes.excluded).sum() * made.SPACING**2
    assert sum(each.density for each in found.objects) == pytest.approx(len(made.SHRUBS) / area)


def test_an_object_of_a_material_that_is_left_out_counts_on_the_ground_that_it_is_placed_on(monkeypatch):
    """A shrub on a speck of ground that has no tiles would else stand as densely as on that speck."""
    field, grid = made.field(), made.grid()
    classes = build.classify_ground(build.measure_ground(field, grid))
    first, *others = classes.footprints
    moved = replace(classes, footprints=[replace(first, material=1), *others])
    parts = build._Parts(field, grid, build.measure_ground(field, grid), moved, 4.0, 0)
    kept = {0: 0}
    dense = build._extract_objects(parts, kept)
    assert {each.material for each in dense} == {0} and dense[0].density == dense[1].density


def test_an_object_on_a_slope_stands_on_level_ground():
    field, grid = made.field(mixed=False, slope=0.3), made.grid(0.3)
    maps = build.measure_ground(field, grid)
    rows, columns = np.mgrid[: made.CELLS, : made.CELLS]
    r, c = made.SHRUBS[0]
    cells = (rows - r) ** 2 + (columns - c) ** 2 <= made.RADIUS**2
    own = extraction.extract_object(field, grid, maps, extraction.bin_standing(field, grid, maps), Footprint(cells, 0))
    discs = own.means[own.ground]
    assert np.abs(discs[:, 2] - extraction.LIFT * made.SPACING).max() < 0.02 * made.SPACING


def test_what_floats_far_above_a_material_is_left_out():
    """Low growth everywhere, and a crown high above a few cells."""
    field, grid = made.field(mixed=False, shrubs=False), made.grid()
    rng = np.random.default_rng(0)
    low = np.concatenate([rng.uniform(1, 11, (400, 2)), rng.uniform(0.1, 0.4, (400, 1))], 1)
    crown = np.concatenate([rng.uniform(3, 4, (40, 2)), rng.uniform(3, 4, (40, 1))], 1)
    points = np.concatenate([low, crown])
    blobs = make_blobs(points, np.full((440, 3), 0.3), np.full(440, 0.05))
    maps = build.measure_ground(field, grid)
    whole = np.ones((made.CELLS, made.CELLS), bool)
    sources = CellSources.identity(made.CELLS)
    kept, _ = extraction.extract_exemplar(concatenate_fields([field, blobs]), grid, maps, sources, whole)
    assert (kept.means[:, 2] > 0.05).sum() == 400
    assert kept.means[:, 2].max() < 1


def test_copied_ground_follows_the_slope():
    field, grid = made.field(mixed=False, shrubs=False, slope=0.3), made.grid(0.3)
    maps = build.measure_ground(field, grid)
    own = np.ones((made.CELLS, made.CELLS), bool)
    own[40:60, 90:110] = False
    sources = CellSources.identity(made.CELLS)
    sources = CellSources(sources.rows, np.where(own, sources.columns, sources.columns - 60))
    made_field, made_grid = extraction.extract_exemplar(field, grid, maps, sources, own)
    heights = made_field.means[: made.CELLS**2, 2].reshape(made.CELLS, made.CELLS)
    wanted = maps.height
    assert np.abs(heights - wanted)[45:55, 95:105].max() < 0.35 * made.SPACING
    assert np.abs(made_grid.heights - wanted)[45:55, 95:105].max() < 0.35 * made.SPACING


def test_the_same_seed_gives_the_same_gaussians(found):
    again = build.find_materials(made.field(), made.grid(), 0)
    for one, two in zip(found.materials, again.materials, strict=True):
        np.testing.assert_array_equal(one.field.means, two.field.means)
        np.testing.assert_array_equal(one.field.sh, two.field.sh)


def test_a_field_without_a_ground_layer_is_tiled_as_one(caplog):
    """Of ground so rough that no height field explains it, or imported."""
    field = replace(made.field(), ground=np.zeros(len(made.field()), bool))
    found = build.find_materials(field, made.grid(), 0)
    assert found.materials[0].field is field and len(found.materials) == 1 and not found.objects
    assert "no ground layer: all of the ground is tiled as one" in caplog.text


def test_ground_of_which_nothing_is_left_is_tiled_as_one(monkeypatch, caplog):
    classes = build.classify_ground(made.maps())
    nowhere = replace(classes, excluded=np.ones_like(classes.excluded))
    monkeypatch.setattr(build, "classify_ground", lambda maps, masks: nowhere)
    field = made.field()
    found = build.find_materials(field, made.grid(), 0)
    assert [each.field is field for each in found.materials] == [True]
    assert "all of the ground is tiled as one" in caplog.text


def test_a_material_of_which_next_to_nothing_is_left_is_left_out(monkeypatch, caplog):
    classes = build.classify_ground(made.maps())
    grass = classes.materials == 1
    few = grass & (np.cumsum(grass.ravel()).reshape(grass.shape) <= 0.02 * grass.size)
    monkeypatch.setattr(
        build, "classify_ground", lambda maps, masks: replace(classes, excluded=classes.excluded | grass & ~few)
    )
    left, whole = build.find_materials(made.field(), made.grid(), 0), classes.source(0)
    assert [each.info.name for each in left.materials] == [classes.names[0]]
    assert left.materials[0].info.share == pytest.approx(1)
    assert left.tile_side == build.choose_tile_side(made.maps(), [whole])  # no smaller tiles for what is left out
    assert f"left of {classes.names[1]}" in caplog.text and "left out" in caplog.text


def test_even_ground_is_given_back_as_it_is():
    field, grid = made.field(mixed=False, shrubs=False), made.grid()
    found = build.find_materials(field, grid, 0)
    assert found.materials[0].field is field and found.materials[0].grid is grid
    assert (found.materials[0].info.share, found.objects, found.tile_side) == (1.0, [], None)


def test_materials_are_written_and_read(found, tmp_path):
    store.write_materials(found, tmp_path / "materials", {"version": "x"})
    report = store.read_report(tmp_path / "materials")
    assert [each.share for each in report.materials] == [each.info.share for each in found.materials]
    exemplars = store.read_exemplars(tmp_path / "materials")
    for (field, grid), material in zip(exemplars, found.materials, strict=True):
        np.testing.assert_array_equal(field.means, material.field.means)
        assert grid.exemplar == pytest.approx(material.grid.exemplar)
    objects = store.read_objects(tmp_path / "materials", 3, made.SPACING)
    assert [len(each.fields) for each in objects] == [3] * len(found.objects)
    assert all(len(each.fields[1]) < len(each.fields[0]) for each in objects)


def test_a_damaged_report_is_named(found, tmp_path):
    store.write_materials(found, tmp_path / "materials", {})
    (tmp_path / "materials/materials.json").write_text('{"verdict": 3}')
    with pytest.raises(InputError, match=r"materials\.json.*find the materials again"):
        store.read_report(tmp_path / "materials")


@pytest.mark.parametrize(("areas", "grade"), [(8.0, "good"), (3.0, "marginal"), (0.5, "no")])
def test_the_verdict_follows_the_photographed_area(areas, grade):
    judged = verdict.judge_material("sand", areas, 0.3)
    assert judged.grade == grade
    assert judged.reason.startswith(f"sand was photographed on {areas:.1f} tile areas")


@pytest.mark.parametrize(("areas", "times"), [(3.99, "1.1"), (3.2, "1.3"), (2.0, "2.0"), (0.5, "8.0")])
def test_the_verdict_never_asks_for_as_much_again_as_there_is(areas, times):
    assert f"photograph {times} times as much" in verdict.judge_material("sand", areas, 0.3).reason


@pytest.mark.parametrize(("areas", "said"), [(1.96, "1.9"), (3.98, "3.9"), (3.96, "3.9"), (1.94, "1.9"), (2.04, "2.0")])
def test_an_area_is_never_rounded_up_to_a_bound_that_it_misses(areas, said):
    assert f"on {said} tile areas" in verdict.judge_material("sand", areas, 0.0).reason


def test_the_verdict_on_a_set_names_materials_of_which_there_is_too_little():
    judged = {name: verdict.judge_material(name, areas, 0.3) for name, areas in (("sand", 8.0), ("rock", 0.5))}
    whole = verdict.judge_set(judged, {"sand": 0.7, "rock": 0.3}, 0.2, 1)
    assert whole.grade == "good" and whole.reason.endswith(
        "a path, road or the like among it; of rock there is too little"
    )
    assert "too little" not in verdict.judge_set({"sand": judged["sand"]}, {"sand": 1.0}, 0.2, 0).reason


def test_the_verdict_on_a_set_is_that_of_the_material_that_covers_most():
    judged = {name: verdict.judge_material(name, areas, 0.3) for name, areas in (("sand", 0.5), ("rock", 8.0))}
    assert verdict.judge_set(judged, {"sand": 0.4, "rock": 0.6}, 0.2, 0).grade == "good"
    assert verdict.judge_set(judged, {"sand": 0.6, "rock": 0.4}, 0.2, 0).grade == "no"


@pytest.mark.parametrize(("areas", "grade"), [(8.0, "marginal"), (3.0, "marginal"), (0.5, "no")])
def test_a_pattern_makes_a_good_verdict_marginal_and_says_what_may_break(areas, grade):
    judged = verdict.judge_material("bricks", areas, 0.0, 0.35)
    assert judged.grade == grade and "(correlation 0.35): rows and lines may break" in judged.reason
    plain = verdict.judge_material("sand", 8.0, 0.0)
    whole = verdict.judge_set({"bricks": judged, "sand": plain}, {"bricks": 0.4, "sand": 0.6}, 0.0, 0, ["bricks"])
    assert whole.grade == "good" and whole.reason.endswith("rows and lines of bricks may break where patches meet")


@pytest.mark.parametrize("mixed", [False, True])
def test_ground_with_a_pattern_is_judged_as_such(mixed):
    field = made.field(mixed=mixed)
    stripes = (
        np.sin(2 * np.pi * (field.means[:, 0] + 0.3 * field.means[:, 1]) / (6 * made.SPACING)) > 0
    ) & field.ground
    sh = field.sh.copy()
    sh[stripes, 0] += 0.3
    found = build.find_materials(replace(field, sh=sh), made.grid(), 0)
    assert found.materials[0].pattern is not None and "may break" in found.materials[0].verdict.reason
    assert found.verdict.grade != "good" and "may break where patches meet" in found.verdict.reason


def test_ground_without_a_pattern_is_not(found):
    assert all(each.pattern is None for each in found.materials) and "may break" not in found.verdict.reason


def test_tiles_made_for_two_areas_of_a_material_have_two():
    maps, decided = made.maps(), 0
    for rows in range(26, 60):
        own = np.zeros(maps.known.shape, bool)
        own[:rows] = True
        side = build.choose_tile_side(maps, [~own, own])
        if np.isclose(side, np.sqrt(own.sum() / 2)):  # not smaller already, by texture
            judged = verdict.judge_material("rock", float(own.sum()) / side**2, 0.0)
            assert judged.grade == "marginal" and "on 2.0 tile areas" in judged.reason
            decided += 1
    assert decided > 5


def test_a_material_too_scarce_for_the_smallest_tiles_makes_no_others_small():
    maps = made.maps()
    own = np.zeros(maps.known.shape, bool)
    own[:8] = True
    assert build.choose_tile_side(maps, [~own, own]) == build.choose_tile_side(maps, [~own])


def test_a_window_is_filled_by_its_material_where_it_can_be():
    own = np.zeros((128, 128), bool)
    own[32:120, 20:120] = True
    row, column, side = build.choose_window(own, 30.0)
    assert own[row : row + side, column : column + side].mean() >= build.OWN_SHARE
    assert side % build.BLOCK == 0


def test_what_an_outline_leaves_out_is_excluded(monkeypatch):
    def halve(maps, footprints, segmenter):
        assert segmenter is None
        kept = np.arange(maps.cells) < maps.cells // 2
        return [replace(each, cells=each.cells & kept) for each in footprints]

    cells = np.zeros((8, 8), bool)
    cells[2:6, 2:6] = True
    nothing = np.zeros((8, 8), int)
    classes = build.GroundClasses(nothing, nothing, [Footprint(cells, 0)], nothing > 0, ["sand"])
    maps = build.measure_ground(made.field(), made.grid()).crop(0, 0, 8)
    monkeypatch.setattr(build.outlines, "refine_footprints", halve)
    refined = build._refine_objects(maps, classes, None)
    assert (refined.occupied | refined.excluded == cells).all() and not (refined.occupied & refined.excluded).any()
    assert refined.excluded.sum() == 8
