"""The formats of `exports/terrain`. To add one, write a function here with the decorator `exporter`.

It writes a job's placed Gaussians to a path without suffix, and returns the number of Gaussians in the files, or None:
the job's. The config and the command line take the names from this registry. Every job of a run reads it, so the
functions import what they need when they are called.
"""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any


@dataclass(frozen=True)
class Format:
    """A format.

    Attributes:
        write: writes an `ExportJob` to a path without suffix.
        axes: of its coordinates, as terrain.json states them: a key of `axes.AXES`.
        bytes: most that a Gaussian takes.
        gaussians: most that a file can hold; None: any number.
        all_levels: whether the files have all levels, whatever level is requested.
    """

    write: Callable[[Any, str], int | None]
    axes: str
    bytes: int
    gaussians: int | None = None
    all_levels: bool = False


FORMATS: dict[str, Format] = {}


def exporter(name: str, **facts: Any) -> Callable:
    """Register the decorated function as the writer of a format; see `Format`."""

    def register(write: Callable[[Any, str], int | None]) -> Callable:
        FORMATS[name] = Format(write, **facts)
        return write

    return register


@exporter("ply", axes="y-down", bytes=68)
def export_ply(job: Any, path: str) -> None:
    """The standard 3DGS PLY."""
    from dav_gswt.export.splat_files import write_ply

    write_ply(job.spool, f"{path}.ply")


@exporter("spz", axes="y-up", bytes=20, gaussians=10_000_000)
def export_spz(job: Any, path: str) -> None:
    """SPZ version 3."""
    from dav_gswt.export.splat_files import write_spz

    write_spz(job.spool, f"{path}.spz")


@exporter("glb", axes="y-up", bytes=60)
def export_glb(job: Any, path: str) -> None:
    """Binary glTF with KHR_gaussian_splatting."""
    from dav_gswt.export.glb import write_splats

    write_splats(job.spool, f"{path}.glb", dict(job.facts))


@exporter("sog", axes="y-down", bytes=68)
def export_sog(job: Any, path: str) -> None:
    """SOG in one file, made from a PLY."""
    from dav_gswt.export.splat_files import write_sog

    write_sog(job.spool, Path(f"{path}.sog"))


@exporter("3dtiles", axes="z-up", bytes=2 * 19, all_levels=True)
def export_3dtiles(job: Any, path: str) -> int:
    """3D Tiles of all levels, compressed."""
    from dav_gswt.export.tiles_3d import write_tileset

    return write_tileset(job, Path(f"{path}_3dtiles"))
