"""Which cells a finite terrain has, and whether its files can be made: checked before any work starts."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array

from dav_gswt.bundle.manifest import Manifest
from dav_gswt.errors import InputError
from dav_gswt.export.formats import Exporter
from dav_gswt.geometry.georeference import Georeference
from dav_gswt.terrain.endless import EndlessTerrain
from dav_gswt.terrain.finite import Area, Disc, count_cells, keep_level

BY_DISTANCE = "by_distance"
MAX_CELLS = 1000  # along a side of an area
FARTHEST = 2**30  # tile sides


@dataclass(frozen=True)
class TerrainExport:
    """What the config's `export` asks for: cells, their level (None: by the distance from the eye), and the eye.

    Attributes:
        origin: world position from which the files' coordinates count: the middle of the area on the plane z = 0.
    """

    area: Area
    level: int | None
    eye: Float[Array, "3"]
    origin: Float[Array, "3"]

    def select(self, terrain: EndlessTerrain) -> EndlessTerrain:
        """The terrain at the requested level."""
        return terrain if self.level is None else keep_level(terrain, self.level)


def choose_area(settings: Mapping[str, Any]) -> tuple[Area, tuple[float, float]]:
    """The cells that the config's `export` names, and the point in their middle, in tile sides."""
    x, y = settings.get("centre", (0.0, 0.0))
    if "radius" in settings:
        disc = Disc(x, y, settings["radius"])
        (west, east), (south, north) = (
            (int(np.floor(at - disc.radius)), int(np.ceil(at + disc.radius))) for at in (x, y)
        )
        return Area(west, south, east - west, north - south, disc), (x, y)
    columns, rows = settings["columns"], settings["rows"]
    if "corner" in settings:
        west, south = settings["corner"]
        return Area(west, south, columns, rows), (west + columns / 2, south + rows / 2)
    west, south = (int(np.floor(at - n / 2 + 0.5)) for at, n in ((x, columns), (y, rows)))
    return Area(west, south, columns, rows), (x, y)


def find_metres(manifest: Manifest, reference: Georeference | None) -> float | None:
    """Metres per unit, if they are known."""
    if reference:
        return reference.metres_per_unit
    return 1.0 if manifest.unit == "metre" else None


def resolve_lengths(settings: Mapping[str, Any], side: float, metres: float | None) -> dict[str, Any]:
    """The config's `export` with `radius` and `centre` in tile sides.

    Args:   side: of a tile, in units. metres: per unit, if they are known.
    Raises: InputError: metres for a terrain without a scale, or more cells than an area may have.
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
        if not 1e-6 <= found["radius"] <= MAX_CELLS / 2:  # a smaller one could touch no cell, by rounding
            raise InputError(f"export.radius: {found['radius']:g} tile sides; 0.000001 to {MAX_CELLS // 2} can be")
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
    """The world position from which the coordinates of an area's files count: its middle, on the plane z = 0."""
    return np.array([area.west + area.columns / 2, area.south + area.rows / 2, 0.0]) * terrain.side


def check_size(
    terrain: EndlessTerrain, wanted: TerrainExport, exporters: Mapping[str, Exporter], max_gb: float
) -> None:
    """Raises: InputError: a format's files would have more Gaussians than they may have."""
    levels = {each.all_levels: replace(wanted, level=0) if each.all_levels else wanted for each in exporters.values()}
    counts = {
        fine: int(count_cells(limited.select(terrain), limited.area, limited.eye).sum())
        for fine, limited in levels.items()
    }
    for name, each in exporters.items():
        count, most = counts[each.all_levels], int(max_gb * 1e9) // each.bytes
        bound = min(most, each.gaussians or most)
        if count > bound:
            why = f"export.max_gb: {max_gb:g} allows" if bound == most else f"the format {name} holds"
            size = f"{describe_area(wanted.area)} up to {count} Gaussians, {why} {bound}"
            hint = suggest_size(wanted.area, count, bound)
            raise InputError(f"export: {name}: {size}; {hint}, a coarser export.level, or a larger export.max_gb")


def describe_area(area: Area) -> str:
    """The beginning of a message about an area that is too large."""
    return f"a radius of {area.disc.radius:g} tiles has" if area.disc else f"{area.columns} x {area.rows} cells have"


def suggest_size(area: Area, count: int, bound: int) -> str:
    """How much smaller an area should be, by the square root of the ratio."""
    keys = "export.radius" if area.disc else "export.columns and export.rows"
    return f"set {keys} to about {(bound / count) ** 0.5:.0%} of that"
