"""The formats of `exports/terrain`. To add one, write a function here with the decorator `exporter`.

The config and the command line take the names from this registry. Every job of a run reads it, so the functions import
what they need when they are called.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import dav_gswt.export.terrain_files


@dataclass(frozen=True)
class Exporter:
    """A format.

    Attributes:
        write: writes a `terrain_files.ExportJob`; returns the number of Gaussians in the files, or None: the job's.
        axes: of its coordinates, as terrain.json states them: a key of `axes.AXES`.
        bytes: most that a Gaussian takes.
        gaussians: most that a file can hold; None: any number.
        all_levels: whether the files have all levels, whatever level is requested.
        check: raises InputError if a program or package that the format needs is not installed.
    """

    write: Callable[["dav_gswt.export.terrain_files.ExportJob"], int | None]
    axes: str
    bytes: int
    gaussians: int | None
    all_levels: bool
    check: Callable[[], object] | None


EXPORTERS: dict[str, Exporter] = {}


def exporter(
    name: str,
    *,
    axes: str,
    bytes: int,
    gaussians: int | None = None,
    all_levels: bool = False,
    check: Callable[[], object] | None = None,
):
    """Register the decorated function as the writer of a format; see `Exporter`."""

    def register(write: Callable[["dav_gswt.export.terrain_files.ExportJob"], int | None]):
        EXPORTERS[name] = Exporter(write, axes, bytes, gaussians, all_levels, check)
        return write

    return register


def _check_npx() -> None:
    from dav_gswt.export.splat_files import find_npx

    find_npx()


@exporter("ply", axes="y-down", bytes=68)
def export_ply(job: "dav_gswt.export.terrain_files.ExportJob") -> None:
    """The standard 3DGS PLY."""
    from dav_gswt.export.splat_files import write_ply

    write_ply(job.spool, job.path(".ply"))


@exporter("spz", axes="y-up", bytes=20, gaussians=10_000_000)
def export_spz(job: "dav_gswt.export.terrain_files.ExportJob") -> None:
    """SPZ version 3."""
    from dav_gswt.export.splat_files import write_spz

    write_spz(job.spool, job.path(".spz"))


@exporter("glb", axes="y-up", bytes=60, gaussians=(2**32 - 65_536) // 60)
def export_glb(job: "dav_gswt.export.terrain_files.ExportJob") -> None:
    """Binary glTF with KHR_gaussian_splatting; lengths in the file have 32 bits."""
    from dav_gswt.export.glb import write_splats

    write_splats(job.spool, job.path(".glb"), dict(job.facts))


@exporter("sog", axes="y-down", bytes=68, check=_check_npx)
def export_sog(job: "dav_gswt.export.terrain_files.ExportJob") -> None:
    """SOG in one file, made from a PLY."""
    from dav_gswt.export.splat_files import write_sog

    write_sog(job.spool, job.path(".sog"))


@exporter("3dtiles", axes="z-up", bytes=2 * 19, all_levels=True)
def export_3dtiles(job: "dav_gswt.export.terrain_files.ExportJob") -> int:
    """3D Tiles of all levels, compressed: CesiumJS draws them."""
    from dav_gswt.export.tiles_3d import write_tileset

    return write_tileset(job, job.path("_3dtiles"), compressed=True)


@exporter("3dtiles_plain", axes="z-up", bytes=2 * 60, all_levels=True)
def export_3dtiles_plain(job: "dav_gswt.export.terrain_files.ExportJob") -> int:
    """3D Tiles of all levels without compression: three.js draws them."""
    from dav_gswt.export.tiles_3d import write_tileset

    return write_tileset(job, job.path("_3dtiles_plain"), compressed=False)
