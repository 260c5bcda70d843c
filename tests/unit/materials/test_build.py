from dataclasses import replace

import numpy as np
import pytest
from fixtures import mixed_ground as made

from dav_gswt.errors import InputError
from dav_gswt.materials import build, extraction, store
from dav_gswt.reconstruction import discs, top_view


@pytest.fixture(scope="module")
def found():
    return build.find_materials(made.field(), made.grid(), 0)


@pytest.mark.parametrize(("number", "colour"), [(0, made.SAND), (1, made.GRASS)])
def test_an_exemplar_shows_its_material_alone_by_a_disc_a_cell_uncertain_if_filled_over_an_underlay(
    found, number, colour
):
    grid, field = found.materials[number].grid, found.materials[number].field
    away = np.abs(top_view.render_exemplar(field, grid).colour - colour).max(-1)
    assert (away < 0.15).mean() > 0.99
    count, under = grid.cells**2, discs.count_underlay(grid)
    assert grid.shape == (grid.cells, grid.cells) and field.ground.sum() == count
    assert discs.find_underlay(field, grid) == slice(count, count + under) and len(field) == count + under
    np.testing.assert_allclose(field.means[:count, :2], grid.centres[:, :2], atol=1e-5)
    uncertain = field.uncertainty[field.ground]
    assert uncertain.max() == pytest.approx(extraction.FILLED)
    assert found.materials[number].filled == pytest.approx(np.mean(uncertain > 0), abs=1e-6)


@pytest.mark.parametrize("has_layer", [False, True])
def test_a_field_without_a_ground_layer_or_of_which_nothing_is_left_is_tiled_as_one(
    found, monkeypatch, caplog, has_layer
):
    """Of ground so rough that no height field explains it, or imported; or all in shade."""
    field = made.field()
    field = replace(field, ground=field.ground & has_layer)
    nowhere = replace(found.classes, excluded=np.ones_like(found.classes.excluded))
    monkeypatch.setattr(build, "classify_ground", lambda *given: nowhere)
    whole = build.find_materials(field, made.grid(), 0)
    assert [each.field is field for each in whole.materials] == [True] and not whole.objects
    assert "all of the ground is tiled as one" in caplog.text


def test_even_ground_is_given_back_as_it_is():
    field, grid = made.field(mixed=False, shrubs=False), made.grid()
    found = build.find_materials(field, grid, 0)
    assert found.materials[0].field is field and found.materials[0].grid is grid
    assert (found.materials[0].info.share, found.objects, found.tile_side) == (1.0, [], None)


def test_materials_are_written_and_read_and_a_damaged_report_is_named(found, tmp_path):
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
    (tmp_path / "materials.json").write_text('{"verdict": 3}')
    with pytest.raises(InputError, match=r"materials\.json.*find the materials again"):
        store.read_report(tmp_path)


@pytest.mark.parametrize(
    ("areas", "grade", "said"),
    [
        (4.0, "good", "on 4.0 tile areas"),
        (3.99, "marginal", "on 3.9 tile areas: repeats may be seen; photograph 1.1 times as much of it"),
        (1.96, "no", "on 1.9 tile areas, and 30% of what its tiles are cut from is made of patches: repeats will"),
        (0.5, "no", "photograph 8.0 times as much of it, or leave it out"),
    ],
)
def test_the_verdict_follows_the_photographed_area_and_rounds_neither_up_to_a_bound_nor_down_to_nothing(
    areas, grade, said
):
    judged = build.judge_material("sand", areas, 0.3)
    assert judged.grade == grade and said in judged.reason and judged.reason.startswith("sand was photographed on")


def test_the_verdict_on_a_set_is_that_of_the_material_that_covers_most_and_names_what_is_scarce():
    judged = {name: build.judge_material(name, areas, 0.3) for name, areas in (("sand", 8.0), ("rock", 0.5))}
    whole = build.judge_set(judged, {"sand": 0.7, "rock": 0.3}, 0.2)
    assert whole.grade == "good"
    assert whole.reason == "2 materials, 20% of the ground is not in the terrain; of rock there is too little"
    assert build.judge_set(judged, {"sand": 0.4, "rock": 0.6}, 0.2).grade == "no"
    assert build.judge_set(judged, {"sand": 0.7, "rock": 0.3}, 0.6).grade == "marginal"
    assert build.judge_set({"sand": judged["sand"]}, {"sand": 1.0}, 0.2).reason.startswith("1 material, 20%")
