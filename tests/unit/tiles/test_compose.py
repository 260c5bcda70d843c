"""Tiles as Gaussians: no holes, no doubles, no seam at a border; levels go on from their cells."""

import io
import json
from dataclasses import replace

import numpy as np
import pytest
from fixtures import tile_sets

from dav_gswt.errors import InputError
from dav_gswt.lod import store as levels
from dav_gswt.tiles import store


def test_every_tile_holds_exactly_one_disc_a_cell_at_every_level(tiles):
    for level, fields in enumerate(tiles.fields):
        spacing = tiles.spacing * 2**level
        n = round(tiles.side / spacing)
        for field in fields:
            x, y = np.floor(field[field.ground].means[:, :2] / np.float32(spacing)).astype(int).T
            np.testing.assert_array_equal(np.bincount(y * n + x, minlength=n * n), 1)
            assert (field.means[:, :2] >= 0).all() and (field.means[:, :2] <= np.float32(tiles.side)).all()


@pytest.mark.parametrize("bit, axis, far", [(8, 0, False), (2, 0, True), (1, 1, False), (4, 1, True)])
def test_tiles_with_the_same_colour_on_a_side_hold_the_same_gaussians_along_it(tiles, bit, axis, far):
    width = 4 * tiles.spacing  # one cell of the coarsest level
    for fields in tiles.fields:
        for colour in (0, bit):
            strips = []
            for tile, field in enumerate(fields):
                depth = tiles.side - field.means[:, axis] if far else field.means[:, axis]
                if tile & bit == colour:
                    strips.append(field[depth < width])
            for other in strips[1:]:
                assert len(other) == len(strips[0])
                # x and y come from one exemplar by one shift; z differs by the levelling, which is flat at the border:
                # sin^2(pi 4 / 48) = 0.067 of it one block inside
                np.testing.assert_array_equal(other.means[:, :2], strips[0].means[:, :2])
                np.testing.assert_array_equal(other.sh, strips[0].sh)


def test_a_set_that_was_written_reads_back_and_repeats_its_bytes(tiles, sample_ground, tmp_path):
    again = tile_sets.tiles_of(sample_ground)
    for name, made in (("a", tiles), ("b", again)):
        store.write_tiles([made], tmp_path / name / "tiles", tmp_path / name / "seams.json", {"from": "a test"})
    levels.write_levels([tile_sets.levels_of(sample_ground)], tmp_path / "levels", {})
    back = store.read_tiles(tmp_path / "a" / "tiles", tmp_path / "a" / "seams.json", tmp_path / "levels")
    np.testing.assert_array_equal(back.labels, tiles.labels)
    np.testing.assert_array_equal(back.shifts, tiles.shifts)
    assert not list((tmp_path / "a").rglob("*.ply")), "composed tiles are known by their recipes"
    for level in range(len(tiles.fields)):
        np.testing.assert_array_equal(back.fields[level][3].means, tiles.fields[level][3].means)
        np.testing.assert_array_equal(back.fields[level][3].sh, tiles.fields[level][3].sh)
    assert back.side == tiles.side and back.report == tiles.report
    for path in sorted((tmp_path / "a").rglob("*.*")):
        assert path.read_bytes() == (tmp_path / "b" / path.relative_to(tmp_path / "a")).read_bytes(), path.name


@pytest.mark.parametrize(
    "changes", [{"levels": "x"}, {"tiles": 0}, {"side": None}, {"side": -1}, {"seams": []}, {"materials": 3}]
)
def test_a_set_that_is_none_is_refused_by_name(tiles, tmp_path, changes):
    store.write_tiles([replace(tiles, fields=[], recipe=None)], tmp_path / "tiles", tmp_path / "seams.json", {})
    values = json.loads((tmp_path / "seams.json").read_text()) | {"levels": 1}
    (tmp_path / "seams.json").write_text(json.dumps(values | changes))
    with pytest.raises(InputError, match="seams.json: not the table of a tile set"):
        store.read_material_tiles(tmp_path / "tiles", tmp_path / "seams.json", tmp_path / "levels")
    (tmp_path / "seams.json").write_text(json.dumps(values))
    with pytest.raises(InputError, match="lod0_tile_00.ply"):
        store.read_tiles(tmp_path / "tiles", tmp_path / "seams.json", tmp_path / "levels")


@pytest.fixture
def read_again(tiles, sample_ground, tmp_path):
    """A function that reads the set from disk, with its labels.npz and seams.json changed and so many levels."""
    store.write_tiles([tiles], tmp_path / "tiles", tmp_path / "seams.json", {})

    def read(labels=None, counts=None, number=tile_sets.LEVELS):
        given = tile_sets.levels_of(sample_ground)
        given = replace(given, fields=given.fields[:number], grids=given.grids[:number])
        levels.write_levels([given], tmp_path / "levels", {})
        if labels is not None:
            (tmp_path / "tiles/labels.npz").write_bytes(labels((tmp_path / "tiles/labels.npz").read_bytes()))
        if counts is not None:
            values = json.loads((tmp_path / "seams.json").read_text())
            (tmp_path / "seams.json").write_text(json.dumps(values | {"counts": counts}))
        return store.read_tiles(tmp_path / "tiles", tmp_path / "seams.json", tmp_path / "levels")

    return read


def without_a_correction(data: bytes) -> bytes:
    arrays, out = dict(np.load(io.BytesIO(data))), io.BytesIO()
    del arrays["corrections"]
    np.savez(out, **arrays)
    return out.getvalue()


@pytest.mark.parametrize(
    "changes, message",
    [
        pytest.param({"counts": []}, "are not those of", id="another table"),
        pytest.param({"number": 2}, "are not those of", id="fewer levels"),
        pytest.param({"labels": lambda data: b"PK"}, "labels.npz: not readable", id="damaged"),
        pytest.param({"labels": without_a_correction}, "labels.npz: not of .*levels", id="without a correction"),
    ],
)
def test_tiles_that_are_not_as_they_were_made_are_refused(read_again, changes, message):
    with pytest.raises(InputError, match=message):
        read_again(**changes)


def test_tiles_go_on_where_the_exemplar_ends(cut, tiles):
    five = cut(wanted=5)
    assert five.layout.levels == 5 and five.layout.composed_levels == 3
    assert five.side == tiles.side
    scales = [[float(np.exp(f.log_scales).mean()) for f in level] for level in five.fields]
    assert (np.diff(scales, axis=0) > 0).all()
    assert [field.ground.sum() for level in five.fields for field in level[:1]] == [(48 >> k) ** 2 for k in range(5)]
