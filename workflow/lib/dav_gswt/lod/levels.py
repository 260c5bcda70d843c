"""The levels of detail of a field, and how many a tile set may have."""

from dataclasses import dataclass

from dav_gswt.field import GaussianField
from dav_gswt.reconstruction.ground import Ground

AUTO = "auto"  # as many levels as save enough Gaussians
MAX_LEVELS = 6  # with AUTO


@dataclass(frozen=True)
class Levels:
    """A field at several levels of detail, finest first.

    Attributes:
        fields, grids: the Gaussians of each level and its ground grid.
        wanted: how many levels the tiles are to have: a number or AUTO.
        stopped: why no coarser level was fitted, as a message.
    """

    fields: list[GaussianField]
    grids: list[Ground]
    wanted: int | str
    stopped: str
