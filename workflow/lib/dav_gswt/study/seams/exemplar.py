"""The exemplar behind a tile set: what the cuts saw of it, and the same patches cut straight without looking."""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array

from dav_gswt.field import GaussianField
from dav_gswt.lod.levels import Levels
from dav_gswt.reconstruction import top_view
from dav_gswt.study.seams.ground import Source, source_of
from dav_gswt.tiles import build, semantics
from dav_gswt.tiles.layout import Exemplar

BLIND = 40  # places: enough that sixteen centres differ


@dataclass(frozen=True)
class Known:
    """The levels, finest first, how many the tiles want, and maps of the finest cells from above, row 0 in the south;
    NaN for holes.
    """

    levels: list[GaussianField]
    wanted: int | str
    exemplar: Exemplar
    colour: Float[Array, "m m 3"]
    uncertainty: Float[Array, "m m"]

    @classmethod
    def of(cls, made: Levels) -> "Known":
        grid = made.grids[0]
        above = top_view.over_exemplar(made.fields[0], grid)
        west, south, _ = grid.exemplar
        return cls(
            made.fields,
            made.wanted,
            Exemplar(west, south, grid.spacing, grid.cells),
            above.known_colour().astype(float),
            above.uncertainty,
        )

    def cut_straight(self, seam: dict, source: semantics.SemanticSource, rng: np.random.Generator) -> build.TileSet:
        """Tiles of the same sizes laid without looking: the ceiling of every measure.

        Straight seams where patches happen to lie (the first of BLIND places), and steps of brightness and height left
        as they are: with the search and the corrections straight seams are hardly worse than cut ones.
        """
        options = build.TilingOptions.from_config(
            dict(seam) | {"energy": "none", "candidates": BLIND}, source, self.wanted
        )
        options = replace(options, tries=1, corrected=False)
        return build.cut_tiles(self.levels, self.exemplar, self.colour, self.uncertainty, options, rng)

    def flattened(self, tiles: build.TileSet, seam: dict) -> Source:
        """The exemplar without the trend that was taken out for a tile set."""
        width = (
            build.TilingOptions.from_config(dict(seam), semantics.SemanticSource()).trend
            * tiles.seams["layout"]["side"]
        )
        return source_of(self.levels, self.exemplar, self.colour, width)
