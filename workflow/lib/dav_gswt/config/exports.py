"""What leaves for other programs: the table `export` of the config. Nothing else depends on it."""

from typing import TYPE_CHECKING, Annotated, Literal

from pydantic import Field

from dav_gswt.config.base import ConfigModel, key
from dav_gswt.export.formats import FORMATS

Coordinate = Annotated[float, Field(ge=-(2**30), le=2**30)]
if TYPE_CHECKING:
    Format = str
else:
    Format = Literal[tuple(FORMATS)]


TERRAIN, GROUND = ("export_terrain",), ("export_ground",)
BOTH = (*TERRAIN, *GROUND)


class Export(ConfigModel):
    """A finite terrain for other programs: `exports/terrain`, and its ground, `exports/ground`. docs/exports.md."""

    columns: int = key("cells from west to east", 8, unit="tiles", read_by=BOTH, ge=1, le=1000)
    rows: int = key("cells from south to north", 8, unit="tiles", read_by=BOTH, ge=1, le=1000)
    centre: list[Coordinate] = key(
        "x and y of the point that the cells lie about",
        [0.0, 0.0],
        unit="tile sides",
        read_by=BOTH,
        min_length=2,
        max_length=2,
    )
    level: int = key("level of detail, 0 the finest", 0, read_by=TERRAIN, ge=0, le=15)
    formats: list[Format] = key(
        "`3dtiles`: all levels in chunks, which CesiumJS draws; `sog` needs Node.js",
        ["glb"],
        read_by=TERRAIN,
        min_length=1,
        max_length=len(FORMATS),
    )
