"""A tile set placed as terrain, beside its exemplar: which patch covers every ground cell.

A patch in the terrain is the whole exemplar, moved so that its cell (x, y) comes to the terrain's cell origin + (x, y).
Both halves of a strip have the same origin, so across a border nothing changes.
"""

from dataclasses import dataclass, replace
from functools import cached_property
from tempfile import TemporaryDirectory

import numpy as np
from jaxtyping import Float, Int, Int64
from numpy import ndarray as Array

from dav_gswt.bundle.build import BundleOptions, write_bundle
from dav_gswt.bundle.content import BundleContent
from dav_gswt.field import GaussianField
from dav_gswt.lod.store import Levels
from dav_gswt.reconstruction import top_view
from dav_gswt.terrain import endless
from dav_gswt.terrain.choice import tiles_at
from dav_gswt.tiles import build, compose, layout, semantics, texture
from dav_gswt.tiles.layout import Exemplar, Layout
from dav_gswt_study.seams.rendering import SpatialIndex

WINDOW = 8  # tiles a side of the terrain that crops are taken from, around its origin
REACH = 16  # radius of the terrain, in tile sides
UNSEARCHED = 40  # candidate places of straight tiles: enough that sixteen centres differ
MEAN_RADIUS = 4  # cells on each side over which the height at a point is averaged


@dataclass(frozen=True)
class DetrendedExemplar:
    """The exemplar of a tile set at every level, without its trend; `ground`: mean colour and height of its cells."""

    exemplar: Exemplar
    levels: list[SpatialIndex]
    ground: Float[Array, "m m 4"]


@dataclass(frozen=True)
class PlacedTiles:
    """A tile set as terrain. tiles: by (level, number). eye_floor: lowest eye height. colour: of the far ground.

    Maps of the window's cells, row 0 in the south; cell (0, 0) of the terrain is at [-first, -first]. patch: a number
    for each patch and place, an index into `origins`. tile: number of the tile. label: of the cell in it.
    correction: change of a tile's cells against the exemplar (colour, height); NaN if unknown.
    """

    source: DetrendedExemplar
    plan: Layout
    terrain: endless.EndlessTerrain
    tiles: dict[tuple[int, int], SpatialIndex]
    eye_floor: float
    colour: list[float]
    first: int
    patch: Int[Array, "w w"]
    tile: Int[Array, "w w"]
    label: Int[Array, "w w"]
    origins: Int[Array, "patches 2"]
    correction: Float[Array, "tiles n n 4"]

    @property
    def spacing(self) -> float:
        return self.source.exemplar.spacing

    @cached_property
    def relief(self) -> Float[Array, "w w"]:
        """Height of the tiles' own ground in every cell of the window; NaN where it is unknown."""
        y, x = np.mgrid[self.first : self.first + len(self.patch), self.first : self.first + len(self.patch)]
        column, row = np.moveaxis(np.stack([x, y], -1) - self.origins[self.patch], -1, 0)
        n = self.plan.side
        return self.source.ground[row, column, 3] + self.correction[self.tile, y % n, x % n, 3]

    def mean_height(self, at: tuple[int, int]) -> float:
        """Mean height of the tiles' own ground around a corner of finest cells; 0 where it is unknown."""
        x, y = (slice(max(v - self.first - MEAN_RADIUS, 0), v - self.first + MEAN_RADIUS) for v in at)
        near = self.relief[y, x]
        known = near[np.isfinite(near)]
        return float(known.mean()) if len(known) else 0.0

    @cached_property
    def corners(self) -> Int[Array, "n 3"]:
        """Corners (x, y) of cells where patches meet in one tile, and whether a centre is one of them."""
        n, patches = self.plan.side, _corner_cells(self.patch)
        y, x = np.nonzero((patches != patches[0]).any(0))
        keep = ((x + 1) % n != 0) & ((y + 1) % n != 0)
        x, y = x[keep], y[keep]
        return np.stack([x + 1, y + 1, (_corner_cells(self.label)[:, y, x] == layout.CENTRE).any(0)], 1)


def detrend_exemplar(
    levels: list[GaussianField], exemplar: Exemplar, colour: Float[Array, "m m 3"], width: float
) -> DetrendedExemplar:
    """The exemplar as `build.cut_tiles` uses it. colour: NaN for holes. width: of the low-pass, in cells."""
    _, height = compose.compute_ground_maps(levels[0], exemplar)
    trend = texture.fit_trend(colour, height, exemplar, width)
    flat = [texture.remove_trend(field, trend) for field in levels]
    corner = np.array([exemplar.west, exemplar.south, 0], np.float32)
    home = replace(exemplar, west=0.0, south=0.0)
    flat = [replace(field, means=field.means - corner) for field in flat]
    return DetrendedExemplar(home, [SpatialIndex.from_field(field) for field in flat], _mean_cells(flat[0], home))


def place_tiles(tiles: build.TileSet, source: DetrendedExemplar, salt: int, tau: float) -> PlacedTiles:
    """The tile set on level ground, placed as its bundle of this tau does. Gaussians are not quantised, since the
    patches of the exemplar that they are compared with are not either.
    """
    with TemporaryDirectory() as folder:
        manifest = write_bundle(BundleContent.of_one_material(tiles), folder, BundleOptions(tau=tau, salt=salt), {})
    terrain = replace(endless.terrain_from_fields(tiles.fields, manifest, {"kind": "flat"}), reach=REACH)
    plan = tiles.layout
    first = -(WINDOW // 2)
    numbers = tiles_in(first, first, (WINDOW, WINDOW), salt, tiles.variants)
    n = plan.side
    label = np.block([[tiles.labels[t] for t in row] for row in numbers]).astype(int)
    tile = np.kron(numbers, np.ones((n, n), int))
    cell = n * (np.arange(WINDOW) + first).repeat(n)  # of the tiles' south-western corners
    origin = np.stack(np.meshgrid(cell, cell), -1) - tiles.shifts[tile, label]
    origins, patch = np.unique(origin.reshape(-1, 2), axis=0, return_inverse=True)
    return PlacedTiles(
        source,
        plan,
        terrain,
        {key: SpatialIndex.from_field(field) for key, field in terrain.tiles.items()},
        manifest.eye_floor,
        manifest.ground_colour,
        first * n,
        patch.reshape(label.shape),
        tile,
        label,
        origins,
        np.stack([_measure_correction(tiles, source, number) for number in range(len(tiles.labels))]),
    )


def tiles_in(west: int, south: int, shape: tuple[int, int], salt: int, variants: int) -> Int64[Array, "h w"]:
    """Tile numbers of a window of cells: row 0 holds cells (west, south), (west + 1, south), ..."""
    height, width = shape
    return tiles_at(*np.meshgrid(west + np.arange(width), south + np.arange(height)), salt, variants)


def _corner_cells(cells: Int[Array, "w w"]) -> Int[Array, "4 v v"]:
    """The four cells around each inner corner."""
    return np.stack([cells[:-1, :-1], cells[:-1, 1:], cells[1:, :-1], cells[1:, 1:]])


def _measure_correction(tiles: build.TileSet, source: DetrendedExemplar, number: int) -> Float[Array, "n n 4"]:
    labels, shift = tiles.labels[number], tiles.shifts[number]
    own = _mean_cells(tiles.fields[0][number], Exemplar(0.0, 0.0, tiles.spacing, len(labels)))
    return own - source.ground[layout.source_cells(labels, shift)]


def _mean_cells(field: GaussianField, cells: Exemplar) -> Float[Array, "m m 4"]:
    colour, height = compose.compute_ground_maps(field, cells)
    return np.concatenate([colour, height[..., None]], -1)


@dataclass(frozen=True)
class ExemplarMaps:
    """The levels of an exemplar, finest first, and maps of its finest cells from above, row 0 in the south; NaN for
    holes.
    """

    levels: list[GaussianField]
    exemplar: Exemplar
    colour: Float[Array, "m m 3"]
    uncertainty: Float[Array, "m m"]

    @classmethod
    def from_levels(cls, levels: Levels) -> "ExemplarMaps":
        grid = levels.grids[0]
        top = top_view.render_exemplar(levels.fields[0], grid)
        west, south, _ = grid.exemplar
        return cls(
            levels.fields,
            Exemplar(west, south, grid.spacing, grid.cells),
            top.colour_or_nan().astype(float),
            top.uncertainty,
        )

    def cut_straight(
        self, tiles: build.TileSet, tiling: dict, source: semantics.SemanticSource, rng: np.random.Generator
    ) -> build.TileSet:
        """Tiles of the sizes of a set with straight seams at unsearched places: the ceiling of every measure.

        Patches lie at the first of UNSEARCHED places, and steps of brightness and height stay: with the search and the
        corrections straight seams would be hardly worse than cut ones.
        """
        plan, own = tiles.layout, {"energy": "none", "candidates": UNSEARCHED}
        sizes = {"tile": plan.side / plan.exemplar, "strip": plan.strip / plan.side}
        options = build.TilingOptions.from_config(tiling | own | sizes, source, len(tiles.fields))
        options = replace(options, tries=1, corrected=False)
        return build.cut_tiles(self.levels, self.exemplar, self.colour, self.uncertainty, options, rng)

    def detrend(self, tiles: build.TileSet, tiling: dict) -> DetrendedExemplar:
        """The exemplar without the trend that was removed for a tile set."""
        options = build.TilingOptions.from_config(tiling, semantics.SemanticSource())
        return detrend_exemplar(self.levels, self.exemplar, self.colour, options.trend * tiles.layout.side)

    def place_with_straight(
        self, tiles: build.TileSet, tiling: dict, source: semantics.SemanticSource, seed: int, tau: float, number: int
    ) -> tuple[PlacedTiles, PlacedTiles]:
        """Place the tile set of a material, by number, and beside it tiles of the same sizes that are cut straight."""
        straight = self.cut_straight(tiles, tiling, source, build.make_generator(seed, tiling, number))
        patches = self.detrend(tiles, tiling)
        return place_tiles(tiles, patches, seed, tau), place_tiles(straight, patches, seed, tau)
