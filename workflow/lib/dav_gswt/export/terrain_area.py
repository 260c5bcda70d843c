"""Which cells a finite terrain has, and whether its files can be made: said before any work starts."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array

from dav_gswt.bundle.manifest import Manifest
from dav_gswt.errors import InputError
from dav_gswt.export import glb, glb_splats, glb_spz, ply, spool, spz, usd
from dav_gswt.geometry.georeference import Georeference
from dav_gswt.terrain.endless import EndlessTerrain
from dav_gswt.terrain.finite import Area, Disc, count_cells, keep_level

BY_DISTANCE = "by_distance"
MAX_CELLS = 1000  # along a side of an area
FARTHEST = 2**30  # tile sides


@dataclass(frozen=True)
class FileLimit:
    """What a Gaussian takes in a file at most, in bytes, and how many Gaussians a file holds; None: any number."""

    bytes: int
    gaussians: int | None = None


LIMITS = {
    "ply": FileLimit(ply.BYTES),
    "spz": FileLimit(max(spz.RAW_BYTES.values()), spz.MAX_GAUSSIANS),
    "glb": FileLimit(glb_splats.BYTES, (glb.MAX_BYTES - glb_splats.HEADER_BYTES) // glb_splats.BYTES),
    "sog": FileLimit(ply.BYTES),  # made from a PLY
    "streamed_sog": FileLimit(2 * ply.BYTES),  # made from one of each level; coarser ones are smaller
    "usd": FileLimit(usd.BYTES),
    "3dtiles": FileLimit(2 * spz.RAW_BYTES[glb_spz.SPZ_VERSION]),  # all levels
}
PLAIN_TILES = FileLimit(2 * glb_splats.BYTES)  # of 3dtiles without compression
ALL_LEVELS = {"streamed_sog", "3dtiles"}  # whatever level is asked for


@dataclass(frozen=True)
class TerrainExport:
    """What the config's `export` asks for: cells, their level (None: by the distance from the eye), and the eye.

    Attributes:
        origin: world position that the files' coordinates count from: the middle of the area on the plane z = 0.
    """

    area: Area
    level: int | None
    eye: Float[Array, "3"]
    origin: Float[Array, "3"]

    def select(self, terrain: EndlessTerrain) -> EndlessTerrain:
        """The terrain that shows the level that is asked for."""
        return terrain if self.level is None else keep_level(terrain, self.level)


def choose_area(settings: Mapping[str, Any]) -> tuple[Area, tuple[float, float]]:
    """The cells that the config's `export` names, and the point that they lie about, in tile sides."""
    x, y = settings.get("centre", (0.0, 0.0))
    if "radius" in settings:
        return surround(Disc(x, y, settings["radius"])), (x, y)
    columns, rows = settings["columns"], settings["rows"]
    if "corner" in settings:
        west, south = settings["corner"]
        return Area(west, south, columns, rows), (west + columns / 2, south + rows / 2)
    west, south = (int(np.floor(at - n / 2 + 0.5)) for at, n in ((x, columns), (y, rows)))
    return Area(west, south, columns, rows), (x, y)


def surround(disc: Disc) -> Area:
    """The cells that a disc touches."""
    (west, east), (south, north) = (
        (int(np.floor(at - disc.radius)), int(np.ceil(at + disc.radius))) for at in (disc.x, disc.y)
    )
    return Area(west, south, east - west, north - south, disc)


def find_metres(manifest: Manifest, reference: Georeference | None) -> float | None:
    """Metres of a unit, where they are known."""
    if reference:
        return reference.metres_per_unit
    return 1.0 if manifest.unit == "metre" else None


def resolve_lengths(settings: Mapping[str, Any], side: float, metres: float | None) -> dict[str, Any]:
    """The config's `export` with `radius` and `centre` in tile sides.

    Args:   side: of a tile, in units. metres: of a unit, if they are known.
    Raises: InputError: metres of a terrain without a scale, or more cells than an area may have.
    """

    def resolve(name: str, value: float | str) -> float:
        if not isinstance(value, str):
            return float(value)
        if metres is None:
            why = "the scale of this terrain is not known (docs/photos.md): give tile sides, a number without m"
            raise InputError(f"export.{name}: {value}: {why}")
        return float(value.removesuffix("m")) / metres / side

    found = dict(settings)
    if "centre" in found:
        found["centre"] = [resolve("centre", at) for at in found["centre"]]
        if not all(abs(at) <= FARTHEST for at in found["centre"]):
            raise InputError(f"export.centre lies beyond {FARTHEST} tile sides")
    if "radius" in found:
        found["radius"] = resolve("radius", found["radius"])
        if not 0 < found["radius"] <= MAX_CELLS / 2:
            raise InputError(f"export.radius: {found['radius']:g} tile sides; more than 0 and at most {MAX_CELLS // 2}")
        area, _ = choose_area(found)
        if not len(area):  # the distance to the cells beside it rounds to the radius
            raise InputError(f"export.radius: {found['radius']:g} tile sides touch no cell; make it larger")
    return found


def plan_export(terrain: EndlessTerrain, settings: Mapping[str, Any], eye_floor: float) -> TerrainExport:
    """The export of the config's `export`. Raises: InputError: the set has no such level."""
    area, centre = choose_area(settings)
    level = None if settings["level"] == BY_DISTANCE else settings["level"]
    if level is not None and level >= len(terrain.switches):
        raise InputError(f"export.level: there is no level {level}; the last one is {len(terrain.switches) - 1}")
    x, y = (at * terrain.side for at in centre)
    ground = float(terrain.heights.at(np.array([x]), np.array([y]))[0][0])
    return TerrainExport(area, level, np.array([x, y, ground + eye_floor]), find_origin(terrain, area))


def find_origin(terrain: EndlessTerrain, area: Area) -> Float[Array, "3"]:
    """The world position that the coordinates of an area's files count from: its middle, on the plane z = 0."""
    return np.array([area.west + area.columns / 2, area.south + area.rows / 2, 0.0]) * terrain.side


def choose_limits(settings: Mapping[str, Any]) -> dict[str, FileLimit]:
    """The limits of the formats that the config's `export` names."""
    plain = {"3dtiles": PLAIN_TILES} if settings["tile_compression"] == "none" else {}
    return {name: (LIMITS | plain)[name] for name in settings["formats"]}


def check_size(
    terrain: EndlessTerrain, wanted: TerrainExport, limits: Mapping[str, FileLimit], max_gb: float
) -> dict[str, int]:
    """The number of Gaussians at most, by format: of the finest level where a format has all levels.

    Raises: InputError: more than a file may have, with the area that fits.
    """
    fine, counts, known = replace(wanted, level=0), {}, {}
    for name, limit in limits.items():
        limited = fine if name in ALL_LEVELS else wanted
        if limited.level not in known:
            known[limited.level] = _count(terrain, limited, wanted.area)
        count = counts[name] = known[limited.level]
        most = int(max_gb * 1e9) // limit.bytes
        bound = min(most, limit.gaussians or most)
        if count > bound:
            why = f"export.max_gb: {max_gb:g} allows" if bound == most else f"the format {name} holds"
            size = f"{_describe(wanted.area)} up to {count} Gaussians, {why} {bound}"
            raise InputError(f"export: {name}: {size}; {_suggest(terrain, limited, bound)}")
    return counts


def _suggest(terrain: EndlessTerrain, wanted: TerrainExport, bound: int) -> str:
    fits = suggest_area(wanted.area, lambda area: _count(terrain, wanted, area), bound)
    if fits is None:
        return "not one cell fits: set export.level to a coarser one, or raise export.max_gb"
    if fits.disc:
        return f"{fits.disc.radius:g} tiles fit: set export.radius, a coarser export.level, or max_gb"
    return f"{fits.columns} x {fits.rows} fit: set export.columns and export.rows, a coarser export.level, or max_gb"


def _describe(area: Area) -> str:
    return f"a radius of {area.disc.radius:g} tiles has" if area.disc else f"{area.columns} x {area.rows} cells have"


def suggest_area(area: Area, count: Callable[[Area], int], bound: int) -> Area | None:
    """The largest area about the same middle, of the same shape, whose count is within a bound; None: not one cell."""
    low, high = 0, max(area.columns, area.rows)
    while high - low > 1:
        middle = (low + high) // 2
        low, high = (middle, high) if count(_shrink(area, middle)) <= bound else (low, middle)
    return _shrink(area, low) if low else None


def _shrink(area: Area, longer: int) -> Area:
    """A smaller area about the middle of one, whose longer side has so many cells, or whose disc is about as wide."""
    if area.disc:
        return surround(replace(area.disc, radius=longer / 2))
    share = longer / max(area.columns, area.rows)
    columns, rows = (max(1, int(n * share)) for n in (area.columns, area.rows))
    return Area(area.west + (area.columns - columns) // 2, area.south + (area.rows - rows) // 2, columns, rows)


def _count(terrain: EndlessTerrain, wanted: TerrainExport, area: Area) -> int:
    return int(count_cells(wanted.select(terrain), area, wanted.eye).sum())


def describe_size(counts: Mapping[str, int], limits: Mapping[str, FileLimit]) -> str:
    """What an export takes, for the log."""
    each = [(f"{name} (finest level)" if name in ALL_LEVELS else name, counts[name], limits[name]) for name in limits]
    files = ", ".join(f"{name} {count} Gaussians, {count * limit.bytes / 1e6:.0f} MB" for name, count, limit in each)
    return f"at most: {files}; {max(counts.values()) * spool.BYTES / 1e6:.0f} MB of disk on the way"
