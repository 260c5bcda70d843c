"""Tiles as Gaussians: no holes, no doubles, no seam at a border, equal heights."""

import json
from dataclasses import replace

import numpy as np
import pytest

from dav_gswt.errors import InputError
from dav_gswt.tiles import build, compose, store
from dav_gswt.tiles.layout import CENTRE, edge_colours


def cells(field, spacing):
    return np.floor(field.means[:, :2] / np.float32(spacing)).astype(int)


def test_every_tile_holds_exactly_one_disc_a_cell_at_every_level(tiles):
    for level, fields in enumerate(tiles.fields):
        spacing = tiles.spacing * 2**level
        n = round(tiles.side / spacing)
        for field in fields:
            x, y = cells(field[field.ground], spacing).T
            np.testing.assert_array_equal(np.bincount(y * n + x, minlength=n * n), 1)


def test_centres_lie_inside_the_tile(tiles):
    for fields in tiles.fields:
        for field in fields:
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


def test_a_strip_goes_on_over_the_border_as_one_piece_of_the_exemplar(tiles, sample_ground):
    """The two halves of a vertical strip, seen in two tiles, are neighbours in the exemplar."""
    n, columns = tiles.labels.shape[1], sample_ground.exemplar.cells
    left, right = 2, 8  # E = 1 of the one is W = 1 of the other
    assert edge_colours(left)[2] == edge_colours(right)[0] == 1
    rows = np.arange(n)
    source = [
        tiles.shifts[tile][tiles.labels[tile][rows, x]] + np.stack([np.full(n, x), rows], 1)
        for tile, x in ((left, n - 1), (right, 0))
    ]
    step = source[1] - source[0]
    together = (step == [1, 0]).all(1)
    # only where the seam between strip and corner patch crosses the border do the pieces differ
    assert together.mean() > 0.9 and (source[0] < columns).all()


def test_the_centre_reaches_neither_the_border_nor_is_it_missing(tiles):
    block = 4
    assert (tiles.labels[:, :block] != CENTRE).all() and (tiles.labels[:, :, -block:] != CENTRE).all()
    assert (tiles.labels[:, 20:28, 20:28] == CENTRE).all()


def test_mean_heights_of_the_finest_tiles_are_equal(tiles):
    heights = [field.means[:, 2].astype(float).mean() for field in tiles.fields[0]]
    # float32 rounding of single heights around 0.1 to 1, in the mean
    assert np.ptp(heights) < 1e-6


def test_levelling_vanishes_at_the_border_in_value_and_slope():
    side, step = 3.0, 1e-5
    edge = np.array([[0, 1.0], [side, 1.0], [1.0, 0], [1.0, side]])
    inward = edge + step * np.array([[1, 0], [-1, 0], [0, 1], [0, -1]])
    np.testing.assert_allclose(compose.bump(edge, side), 0, atol=1e-15)
    # quadratic: (pi step / side)^2
    assert compose.bump(inward, side).max() / step < 2 * step * (np.pi / side) ** 2
    assert compose.bump(np.array([[1.5, 1.5]]), side) == pytest.approx(1)


def test_a_coarse_cell_takes_the_label_of_most_of_its_cells():
    labels = np.array([[1, 1, 0, 2], [1, 3, 2, 0]], np.uint8)
    np.testing.assert_array_equal(compose.coarsen_labels(np.concatenate([labels, labels]), 2), [[1, 0], [1, 0]])


def test_things_follow_the_cell_under_their_centre(sample_ground):
    level = compose.bin_gaussians(sample_ground.levels[0], sample_ground.exemplar, 1)
    n, shift = 8, np.zeros((9, 2), int)
    shift[1] = [16, 4]
    labels = np.zeros((n, n), np.uint8)
    labels[:, 4:] = 1
    tile = compose.compose_tile(level, labels, shift)
    found = tile[~tile.ground].means[:, :2].astype(float)
    field, e = sample_ground.levels[0], sample_ground.exemplar
    at = field[~field.ground].means[:, :2].astype(float) - [e.west, e.south]
    here = (at < [0.5, 1]).all(1)
    moved = at - [2, 0.5]
    there = (moved >= [0.5, 0]).all(1) & (moved < 1).all(1)
    expected = np.concatenate([at[here], moved[there]])
    order = lambda v: v[np.lexsort(v.T)]  # noqa: E731
    np.testing.assert_allclose(order(found), order(expected), atol=1e-6)  # float32 positions near 10


def test_the_same_seed_gives_the_same_tiles(tiles, sample_ground):
    options = build.TilingOptions(share=0.5, strip=0.17, candidates=40, tries=2)
    again = build.cut_tiles(
        sample_ground.levels,
        sample_ground.exemplar,
        sample_ground.colour,
        np.zeros((96, 96)),
        options,
        np.random.default_rng(2),
    )
    np.testing.assert_array_equal(again.labels, tiles.labels)
    for a, b in zip(again.fields[0], tiles.fields[0], strict=True):
        np.testing.assert_array_equal(a.means, b.means)


def test_variants_are_other_centres_in_the_same_frames(sample_ground):
    options = build.TilingOptions(share=0.5, strip=0.17, variants=2, candidates=40, tries=1)
    two = build.cut_tiles(
        sample_ground.levels,
        sample_ground.exemplar,
        sample_ground.colour,
        np.zeros((96, 96)),
        options,
        np.random.default_rng(2),
    )
    assert len(two.labels) == 32 and two.variants == 2
    frame = two.labels[:, :4]
    np.testing.assert_array_equal(frame[:16], frame[16:])
    assert (two.shifts[:16, CENTRE] != two.shifts[16:, CENTRE]).any(1).all()


def test_uncertain_ground_is_not_used_where_certain_ground_is_available(sample_ground):
    uncertainty = np.zeros((96, 96))
    uncertainty[:, :30] = 1
    options = build.TilingOptions(share=0.5, strip=0.17, candidates=400, tries=1)
    found = build.cut_tiles(
        sample_ground.levels,
        sample_ground.exemplar,
        sample_ground.colour,
        uncertainty,
        options,
        np.random.default_rng(2),
    )
    # a patch may be up to UNCERTAINTY_MARGIN more uncertain than the least uncertain one, which is 0
    assert found.uncertainty.max() < 0.1


def test_a_set_that_was_written_reads_back_and_repeats_its_bytes(tiles, tmp_path):
    for name in ("a", "b"):
        store.write_tiles(tiles, tmp_path / name / "tiles", tmp_path / name / "seams.json", {"from": "a test"})
    back = store.read_tiles(tmp_path / "a" / "tiles", tmp_path / "a" / "seams.json")
    np.testing.assert_array_equal(back.labels, tiles.labels)
    np.testing.assert_array_equal(back.shifts, tiles.shifts)
    np.testing.assert_array_equal(back.fields[1][3].means, tiles.fields[1][3].means)
    assert back.side == tiles.side and back.report == tiles.report
    for path in sorted((tmp_path / "a").rglob("*.*")):
        assert path.read_bytes() == (tmp_path / "b" / path.relative_to(tmp_path / "a")).read_bytes(), path.name


def test_a_set_with_a_missing_tile_names_it(tiles, tmp_path):
    store.write_tiles(tiles, tmp_path / "tiles", tmp_path / "seams.json", {})
    (tmp_path / "tiles" / "lod1_tile_07.ply").unlink()
    with pytest.raises(InputError, match="lod1_tile_07.ply"):
        store.read_tiles(tmp_path / "tiles", tmp_path / "seams.json")


@pytest.mark.parametrize(
    "changes", [{"levels": "x"}, {"levels": -1}, {"tiles": 1.5}, {"side": None}, {"side": -1}, {"seams": []}]
)
def test_a_table_that_is_none_is_refused_by_name(tiles, tmp_path, changes):
    store.write_tiles(tiles, tmp_path / "tiles", tmp_path / "seams.json", {})
    values = json.loads((tmp_path / "seams.json").read_text())
    (tmp_path / "seams.json").write_text(json.dumps(values | changes))
    with pytest.raises(InputError, match="seams.json: not the table of a tile set"):
        store.read_tiles(tmp_path / "tiles", tmp_path / "seams.json")


def test_a_level_from_elsewhere_is_refused(sample_ground):
    away = [replace(f, means=f.means + np.float32(1000)) for f in sample_ground.levels]
    with pytest.raises(InputError, match="ground.json"):
        build.cut_tiles(
            [sample_ground.levels[0], *away[1:]],
            sample_ground.exemplar,
            sample_ground.colour,
            np.zeros((96, 96)),
            build.TilingOptions(tries=1, candidates=5),
            np.random.default_rng(0),
        )
