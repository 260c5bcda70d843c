"""The formats of `exports/terrain`. To add one, add its facts here and its writer to `terrain_files.WRITERS`.

The config and the command line take the names from this table, which every job of a run reads: it imports nothing slow.
"""

from dataclasses import dataclass


@dataclass(frozen=True)
class Format:
    """What is known of a format before its files are written.

    Attributes:
        axes: of its coordinates, as terrain.json states them: a key of `axes.AXES`.
        bytes: most that a Gaussian takes.
        gaussians: most that a file can hold; None: any number.
        all_levels: whether the files have all levels, whatever level is requested.
    """

    axes: str
    bytes: int
    gaussians: int | None = None
    all_levels: bool = False


FORMATS = {
    "ply": Format("y-down", 68),  # the standard 3DGS PLY
    "spz": Format("y-up", 20, gaussians=10_000_000),  # version 3
    "glb": Format("y-up", 60),
    "sog": Format("y-down", 68),  # made from a PLY
    "3dtiles": Format("z-up", 2 * 19, all_levels=True),
}
