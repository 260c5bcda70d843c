"""The exemplar of a tile set, and tiles cut straight from it without a search."""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array

from dav_gswt.field import GaussianField
from dav_gswt.lod.levels import Levels
from dav_gswt.reconstruction import top_view
from dav_gswt.tiles import build, semantics
from dav_gswt.tiles.layout import Exemplar
from dav_gswt_study.seams.placed_tiles import DetrendedExemplar, PlacedTiles, detrend_exemplar, place_tiles

UNSEARCHED = 40  # candidate places: enough that sixteen centres differ


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
