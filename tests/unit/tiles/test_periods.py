"""Regular ground: its periods, the turned exemplar, tiles that are whole periods, and no false alarm."""

import json
from dataclasses import replace

import numpy as np
import pytest
from fixtures import ground as made
from scipy.ndimage import gaussian_filter

from dav_gswt.cli import judgement
from dav_gswt.field import concatenate_fields
from dav_gswt.lod import store as level_store
from dav_gswt.lod.store import Levels
from dav_gswt.photos.training_views import TrainingView
from dav_gswt.raster import render
from dav_gswt.reconstruction import discs
from dav_gswt.reconstruction.coarse import StartViews, fit_coarse_field
from dav_gswt.reconstruction.fitting.plan import FitSettings
from dav_gswt.reconstruction.ground import Ground
from dav_gswt.tiles import build, layout, periods, store

CELLS, SPACING = 160, 0.05
FURROWS = np.array([-np.sin(np.radians(27)), np.cos(np.radians(27))]) / 13.2  # rows 27 degrees from east
OPTIONS = build.TilingOptions(share=0.4, strip=0.125, candidates=40, tries=1, kind="colour", levels=3)


def noise(slope, cells=CELLS, seed=0):
    """Noise whose amplitude falls with a power of the frequency, of deviation 1."""
    frequency = np.hypot(np.fft.fftfreq(cells)[:, None], np.fft.rfftfreq(cells)) * cells
    spectrum = np.fft.rfft2(np.random.default_rng(seed).normal(size=(cells, cells)))
    made = np.fft.irfft2(spectrum * np.minimum(1, np.maximum(frequency, 0.5) ** -slope), s=(cells, cells))
    return made / made.std()


def coloured(bright):
    return np.clip(bright, 0, 1)[..., None] * np.array([1.0, 0.9, 0.7])


def furrows(x, y):
    """Brightness of rows with the wave vector FURROWS, with a harmonic."""
    phase = 2 * np.pi * (FURROWS[0] * x + FURROWS[1] * y)
    return 0.5 + 0.1 * np.cos(phase) + 0.04 * np.cos(2 * phase + 1)


def bricks(degrees, size=(31.3, 11.7), cells=256):
    """Running bond with mortar, turned, each brick of another brightness."""
    y, x = np.mgrid[:cells, :cells]
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    along, across = c * x + s * y, c * y - s * x
    course = np.floor(across / size[1]).astype(int)
    place = along / size[0] + 0.5 * (course % 2)
    shade = np.random.default_rng(1).normal(0, 0.05, 997)[(131 * course + np.floor(place).astype(int)) % 997]
    mortar = (place % 1 * size[0] < 2.5) | (across % size[1] < 2.5)
    return coloured(gaussian_filter(np.where(mortar, 0.25, 0.55 + shade), 0.7))


def levels_of(colour, things=None, number=3):
    fields, grids = [], []
    for k in range(number):
        cells = len(colour)
        grid = Ground(2.0, -1.0, SPACING * 2**k, 0, 0, cells, np.zeros((cells, cells)), np.ones((cells, cells), bool))
        layer = discs.make_ground_discs(grid, colour.reshape(-1, 3))
        fields.append(concatenate_fields([layer, discs.make_underlay(grid, layer), *([things] if things else [])]))
        grids.append(grid)
        colour = colour.reshape(cells // 2, 2, cells // 2, 2, 3).mean((1, 3))
    return Levels(fields, grids, number, "")


@pytest.fixture(scope="module")
def ploughed():
    y, x = np.mgrid[:CELLS, :CELLS]
    return coloured(furrows(x, y) + 0.03 * noise(0.5))


@pytest.fixture(scope="module")
def cut(ploughed):
    return build.cut_levels(levels_of(ploughed), OPTIONS, np.random.default_rng(0))


def test_rows_have_one_wave_with_their_period_and_direction(ploughed):
    (found,) = periods.find_waves(ploughed)
    # over the whole exemplar the phase is off by 0.03 of a period
    np.testing.assert_allclose(found * np.sign(found @ FURROWS), FURROWS, atol=0.03 / CELLS)


@pytest.mark.parametrize("degrees", [0, 12, 40])
def test_bricks_have_two_waves_whose_periods_lead_from_each_brick_to_another(degrees):
    waves = periods.find_waves(bricks(degrees))
    assert 1 / abs(np.linalg.det(waves)) == pytest.approx(31.3 * 11.7, rel=0.01)  # one brick in each cell
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    for move in ((31.3, 0), (31.3 / 2, 11.7), (0, 2 * 11.7)):  # along a course, to the next, to the next but one
        turned = np.array([c * move[0] - s * move[1], s * move[0] + c * move[1]])
        np.testing.assert_allclose(waves @ turned, np.rint(waves @ turned), atol=0.02)


def test_grounds_without_a_pattern_that_lasts_have_no_waves(ploughed):
    y, x = np.fft.fftfreq(256)[:, None] * 256, np.fft.rfftfreq(256) * 256
    band = np.exp(-((abs(y) - 16) ** 2 + (x - 6) ** 2) / 8)  # wavelengths differ by a tenth, as of ripples of sand
    ripples = np.fft.irfft2(band * np.fft.rfft2(np.random.default_rng(3).normal(size=(256, 256))))
    half = np.where(np.arange(CELLS)[:, None, None] < CELLS // 2, ploughed, coloured(0.5 + 0.03 * noise(0.5)))
    kinds = [coloured(0.5 + 0.1 * noise(slope, 256)) for slope in (0, 0.5, 1, 1.5, 2, 3)]
    kinds += [coloured(0.5 + 0.1 * ripples / ripples.std() + 0.02 * noise(0.5, 256)), half, np.full((64, 64, 3), 0.5)]
    assert [len(periods.find_waves(kind)) for kind in kinds] == [0] * len(kinds)


def test_tiles_are_whole_numbers_of_rows_and_their_patches_are_in_phase(cut):
    pattern, plan = cut.report["pattern"], cut.layout
    waves = np.array(pattern["waves"]) @ np.array(pattern["turn"])
    np.testing.assert_allclose(waves * plan.side, pattern["counts"], atol=1e-9)
    phase = (cut.shifts.reshape(-1, 2) - cut.shifts[0, layout.SW]) @ waves[0]
    assert np.abs(phase - np.rint(phase)).max() <= periods.IN_PHASE
    assert len(np.unique(cut.report["places"]["centres"], axis=0)) > 8


def test_rows_go_on_over_the_borders_of_tiles(cut, ploughed):
    n = cut.layout.side
    ground = [field[field.ground] for field in cut.fields[0]]
    cells = [np.lexsort(np.floor(each.means[:, :2].T / np.float32(cut.spacing))) for each in ground]
    tiles = [each.base_colours[order].mean(1).reshape(n, n) for each, order in zip(ground, cells, strict=True)]
    torus = layout.arrange_torus(0)[1:5, 1:5]
    terrain = np.block([[tiles[t] for t in row] for row in torus])
    power = np.abs(np.fft.fft2(terrain - terrain.mean())) ** 2
    east, north = 4 * np.array(cut.report["pattern"]["counts"][0])
    kept = 2 * power[north, east] / power.sum()
    there = 0.5 * (0.1 * ploughed.mean(-1).mean() / 0.5) ** 2 / ploughed.mean(-1).var()  # of rows of amplitude 0.1
    # blur of the resampling leaves out grain, which raises it by less than a tenth
    assert 0.9 * there < kept < 1.1 * there


def test_tiles_of_regular_ground_are_read_as_they_were_cut(cut, ploughed, tmp_path):
    level_store.write_levels([levels_of(ploughed)], tmp_path / "levels", {})
    store.write_tiles([cut], tmp_path / "tiles", tmp_path / "seams.json", {})
    back = store.read_tiles(tmp_path / "tiles", tmp_path / "seams.json", tmp_path / "levels")
    for one, two in zip(back.fields, cut.fields, strict=True):
        np.testing.assert_array_equal(one[5].means, two[5].means)
    (exemplar,) = store.read_exemplars(tmp_path / "seams.json", tmp_path / "levels")
    assert exemplar.grids[0].cells == cut.layout.exemplar
    table = json.loads((tmp_path / "seams.json").read_text())
    said = judgement.describe_patterns(made.FRAME, table | {"materials": [{"seams": {"pattern": None}}]})
    assert said == ["The ground has rows every 0.66 m, 27 degrees from east: tiles are whole numbers of them."]


def test_rows_of_which_no_tile_is_a_whole_number_are_warned_of_and_cut_as_they_are(ploughed, caplog, monkeypatch):
    monkeypatch.setattr(periods, "MOST_CHANGED", 0.0)
    tiles = build.cut_levels(levels_of(ploughed), OPTIONS, np.random.default_rng(0))
    assert tiles.report["pattern"] is None and tiles.layout.exemplar == CELLS
    assert "rows every 0.66, 27 degrees from east: they will break" in caplog.text


def test_rows_in_photos_are_found_in_their_field_and_go_on_over_its_tiles():
    grid = made.grid(0.025)
    layer = discs.make_ground_discs(grid, coloured(furrows(*(grid.centres[:, :2].T / 0.025))))
    views = [
        TrainingView(view.name, view.camera.resized(160, 160), pixels, np.ones((160, 160), np.float32))
        for view in made.photos(6, 160)
        for pixels in [np.clip(render(layer, view.camera).colour, 0, 1).astype(np.float32)]
    ]
    settings = FitSettings(fit_size=160, spacing=1.0, max_gaussians=20000, steps=60)
    none = np.zeros((0, 3)), np.zeros((0, 3), np.float32)
    start = StartViews(replace(made.FRAME, kind="synthetic"), views, *none, 0.15)
    fitted = fit_coarse_field(start, settings, np.random.default_rng(0))
    grid = replace(fitted.grid, **{key: float(getattr(fitted.grid, key)) for key in ("west", "south", "spacing")})
    levels = Levels([fitted.field], [grid], 1, "")
    tiles = build.cut_levels(levels, replace(OPTIONS, levels=1), np.random.default_rng(0))
    (wave,) = np.array(tiles.report["pattern"]["waves"]) / tiles.spacing
    # heights of so short a fit are off by a fiftieth of the eye's, and rows with them
    assert np.linalg.norm(wave) == pytest.approx(1 / (13.2 * 0.025), rel=0.03)
    assert tiles.layout.side * tiles.spacing == pytest.approx(tiles.side)
