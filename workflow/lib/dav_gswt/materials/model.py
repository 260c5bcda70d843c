"""What a terrain is made of: materials, each with its own tiles, and objects that stand on them."""

from dataclasses import dataclass

from dav_gswt.field import GaussianField


@dataclass(frozen=True)
class MaterialInfo:
    """A class of ground.

    Attributes:
        name: for people and for the rules of the config.
        share: of the ground, in (0, 1]; the shares of all materials sum to 1.
        patch_scale: typical width of a stretch of it: the mean length, in world units, of what a straight line crosses
            in one piece.
        colour: mean sRGB colour, in [0, 1].
        fray: mean distance, in world units, of its borders from their smooth course; None where none was seen.
        bend: the same between that course and a still smoother one (`borders`).
    """

    name: str
    share: float
    patch_scale: float
    colour: list[float]
    fray: float | None
    bend: float | None


@dataclass(frozen=True)
class ObjectLevels:
    """A single thing that was taken out of the ground, to be placed anywhere on its material.

    Attributes:
        name: for people.
        fields: its Gaussians at each level, finest first, as many levels as the tiles have. Positions count from its
            foot; z = 0 is the level of the ground.
        radius: of its footprint.
        material: number of the material that it stands on.
        density: number of such objects per unit of area of that material.
    """

    name: str
    fields: list[GaussianField]
    radius: float
    material: int
    density: float
