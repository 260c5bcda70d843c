"""The oasis: where its materials and objects are, and that its labels agree with what is rendered."""

import numpy as np
import pytest
from scipy import ndimage

from dav_gswt.geometry import camera_layouts
from dav_gswt.photos.synthetic import labels, land, oasis, oasis_layout, truth
from dav_gswt.photos.synthetic import scene as synthetic

pytest.importorskip("mitsuba")
SIDE = 128  # pixels


@pytest.fixture(scope="module")
def small():
    """Ground of fewer texels and nothing far away: quick to make, and otherwise the same."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(oasis, "TEXELS", 512)
        patch.setattr(oasis, "NEAR", 5.0)
        patch.setattr(oasis, "FAR", 8.0)
        patch.setattr(land, "STONE_SQUARE", 8.0)
        yield
    synthetic._load_scene.cache_clear(), synthetic._load_isolated.cache_clear()


@pytest.fixture(scope="module")
def view(small):
    """A picture of the exemplar from above, and its truth with material and object."""
    scene, camera = synthetic.make_scene("oasis", 0), camera_layouts.orbit(90, 0, 7.0, (0, 0, 0), SIDE, SIDE, 46.0)
    picture = synthetic.render(scene, camera, 9)
    depth, label = truth.render_truth(scene, camera)
    objects = synthetic.render_isolated_depths(scene, camera, ("objects",))["objects"]
    known = synthetic.load_labels(scene)
    surfaces = truth.label_surfaces(known, camera, depth, label, objects)
    return scene, camera, picture, label, surfaces["material"], surfaces["object"]


@pytest.fixture(scope="module")
def ground(view):
    scene = view[0]
    return labels.draw_label_map(synthetic.load_labels(scene), scene.frame.exemplar, 300)


def layout(seed, half=0.2):
    return oasis_layout.draw_layout(np.random.default_rng(seed), 512, 6.0, (0.33, 0.165), half)


def in_exemplar(raster):
    """The part of a raster that is the exemplar."""
    middle = np.roll(raster, (len(raster) // 2,) * 2, (0, 1))
    edge = round(len(raster) * 5 / 16)
    return middle[edge:-edge, edge:-edge]


@pytest.mark.parametrize("seed", range(8))
def test_materials_hold_their_share_of_the_exemplar_in_few_large_stretches(seed):
    material = in_exemplar(layout(seed).material)
    for number, share in ((oasis_layout.MEADOW, 0.33), (oasis_layout.BOULDERS, 0.165)):
        assert (material == number).mean() == pytest.approx(share, abs=0.01)
        pieces, _ = ndimage.label(material == number)
        areas = np.sort(np.bincount(pieces.ravel())[1:])[::-1]
        assert areas[0] > 0.5 * areas.sum() and areas[:3].sum() > 0.85 * areas.sum()


@pytest.mark.parametrize("seed", range(4))
def test_the_path_is_narrow_and_goes_all_the_way_through_the_exemplar(seed):
    path = in_exemplar(layout(seed).material) == oasis_layout.PATH
    pieces, _ = ndimage.label(path, np.ones((3, 3)))
    longest = pieces == 1 + np.argmax(np.bincount(pieces.ravel())[1:])
    rows, columns = np.nonzero(longest)
    assert max(np.ptp(rows), np.ptp(columns)) == len(path) - 1
    widest = 2 * ndimage.distance_transform_edt(path).max() * 16 / 512
    assert 0.3 < widest < 0.7


def test_there_may_be_no_path():
    assert oasis_layout.PATH not in layout(0, half=0.0).material


def test_objects_are_as_many_as_promised_and_stand_apart_on_sand_or_meadow(ground):
    shrubs = [thing for thing in ground.objects if thing.kind == "shrub"]
    assert 8 <= len(shrubs) <= 15 and 3 <= len(ground.objects) - len(shrubs) <= 6
    for thing in ground.objects:
        assert 2 * thing.radius <= 0.6
        assert max(abs(thing.x), abs(thing.y)) + thing.radius < 3.0
        beneath = ground.material[ground.object == thing.id]
        assert len(beneath) and np.isin(beneath, [oasis_layout.SAND, oasis_layout.MEADOW]).mean() > 0.95
        for other in ground.objects:
            away = np.hypot(thing.x - other.x, thing.y - other.y) - thing.radius - other.radius
            assert other is thing or away > 0.4


def test_materials_have_their_colours_in_a_picture_from_above(view):
    _, _, picture, label, material, objects = view
    mean = {}
    for name, number in oasis_layout.MATERIALS.items():
        inner = ndimage.binary_erosion((material == number) & (objects == 0), iterations=2)
        assert inner.sum() > 200, name
        mean[name] = picture[inner].mean(axis=0)
    sand, meadow, boulders, path = (mean[name] for name in ("sand", "meadow", "boulders", "path"))
    assert sand[0] > sand[1] > sand[2] + 0.08 and sand.mean() > 0.5
    assert meadow[1] > meadow[0] and meadow[1] > meadow[2] + 0.05
    assert boulders.mean() < sand.mean() - 0.08 and np.ptp(boulders) < np.ptp(sand)
    assert path.mean() < sand.mean() - 0.06 and path[0] > path[1] > path[2]


def test_stones_and_plants_are_seen_where_their_material_is(view):
    _, _, _, label, material, objects = view
    loose = objects == 0
    share = {
        name: [(label[loose & (material == number)] == kind).mean() for kind in (truth.STONE, truth.PLANT)]
        for name, number in oasis_layout.MATERIALS.items()
    }
    assert share["meadow"][1] > 0.3 > 0.1 > share["sand"][1]
    assert share["boulders"][0] > 0.5 > 0.1 > share["sand"][0]
    assert max(share["path"]) < 0.1


def test_objects_in_a_picture_are_where_the_map_has_them(view, ground):
    _, camera, _, label, _, objects = view
    for thing in ground.objects:
        rows, columns = np.nonzero(objects == thing.id)
        pixel = camera.project(np.array([[thing.x, thing.y, 0.1]]))[0][0]
        reach = thing.radius * camera.fx / 6.5
        assert len(rows) > 0.1 * np.pi * reach**2
        assert np.hypot(columns.mean() + 0.5 - pixel[0], rows.mean() + 0.5 - pixel[1]) < 0.6 * reach
        assert (label[rows, columns] == (truth.PLANT if thing.kind == "shrub" else truth.STONE)).all()


def test_no_other_stone_on_open_ground_is_as_wide_as_an_object(view):
    _, camera, _, label, material, objects = view
    open_ground = np.isin(material, [oasis_layout.SAND, oasis_layout.MEADOW, oasis_layout.PATH])
    open_ground = ndimage.binary_erosion(open_ground, iterations=6, border_value=1)
    stones = ndimage.distance_transform_edt(open_ground & (label == truth.STONE) & (objects == 0))
    assert 2 * stones.max() * 6.9 / camera.fx < 2 * min(oasis.BOULDER_RADII)


def test_a_truth_file_has_material_and_object_and_is_read_as_any_other(view, tmp_path):
    scene, camera, _, label, material, objects = view
    truth.write_truth(tmp_path / "view.exr", scene, camera)
    channels, header = truth.image_files.read_exr(tmp_path / "view.exr")
    assert set(channels) == {"Z", "label", "material", "object"}
    assert (channels["material"] == material).all() and (channels["object"] == objects).all()
    assert header["materials"] == '{"sand": 1, "meadow": 2, "boulders": 3, "path": 4}'
    assert (truth.read_truth(tmp_path / "view.exr")[1] == label).all()
