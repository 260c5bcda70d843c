"""What leaves for other programs: the table `export` of the config. Nothing else depends on it."""

from typing import TYPE_CHECKING, Annotated, Literal

from pydantic import Field, model_validator

from dav_gswt.config.base import ConfigModel, key
from dav_gswt.export.formats import EXPORTERS

Cell = Annotated[int, Field(ge=-(2**30), le=2**30)]
Length = Annotated[float, Field(gt=0, le=500)] | Annotated[str, Field(pattern=r"^\d{1,9}(\.\d{1,9})? ?m$")]
Coordinate = float | Annotated[str, Field(pattern=r"^-?\d{1,12}(\.\d{1,9})? ?m$")]
if TYPE_CHECKING:
    Format = str
else:
    Format = Literal[tuple(EXPORTERS)]


TERRAIN, GROUND = ("export_terrain",), ("export_ground",)
BOTH = (*TERRAIN, *GROUND)


class Export(ConfigModel):
    """A finite terrain for other programs: `exports/terrain`, and its ground, `exports/ground`. docs/exports.md."""

    columns: int = key("cells from west to east", 8, unit="tiles", read_by=BOTH, ge=1, le=1000)
    rows: int = key("cells from south to north", 8, unit="tiles", read_by=BOTH, ge=1, le=1000)
    centre: list[Coordinate] | None = key(
        "x and y of the point that the cells lie about, or metres, such as `12m`; [0, 0] if left out",
        None,
        unit="tile sides",
        read_by=BOTH,
        min_length=2,
        max_length=2,
    )
    corner: list[Cell] | None = key(
        "column and row of the south-western cell, instead of `centre`",
        None,
        unit="tiles",
        read_by=BOTH,
        min_length=2,
        max_length=2,
    )
    radius: Length | None = key(
        "instead of `columns` and `rows`: all cells within this distance of `centre`, or metres, such as `20m`",
        None,
        unit="tile sides",
        read_by=BOTH,
    )
    level: Annotated[int, Field(ge=0, le=15)] | Literal["by_distance"] = key(
        "level of detail, 0 the finest; `by_distance`: as seen from the centre, an eye floor above the surface",
        0,
        read_by=TERRAIN,
    )
    formats: list[Format] = key(
        "`streamed_sog`, `3dtiles`, `3dtiles_plain`: all levels in chunks; `sog` and `streamed_sog` need Node.js, "
        "`usd` the extra `usd`; CesiumJS draws `3dtiles`, three.js `3dtiles_plain`",
        ["glb"],
        read_by=TERRAIN,
        min_length=1,
        max_length=len(EXPORTERS),
    )
    axes: Literal["own", "z-up", "y-up", "y-down"] = key(
        "`own`: the usual axes of each format (docs/exports.md), which a format also keeps if it cannot have others",
        "own",
        read_by=TERRAIN,
    )
    max_gb: float = key(
        "most that a file may take; what would be larger is refused before any work",
        2,
        unit="GB",
        read_by=TERRAIN,
        gt=0,
        le=64,
    )
    surface: Literal["ground", "visible"] = key(
        "what `exports/ground` takes for ground: the ground layer alone, or all but the objects, seen from above",
        "ground",
        read_by=GROUND,
    )
    mesh_error: float = key(
        "of the collision mesh: most that it is off the ground's height field",
        0.25,
        unit="ground cells",
        read_by=GROUND,
        ge=0,
        le=100,
    )

    @model_validator(mode="after")
    def _require_sense(self) -> "Export":
        if self.centre is not None and self.corner is not None:
            raise ValueError("centre and corner exclude one another; leave one out")
        if self.radius is not None and self.corner is not None:
            raise ValueError("radius and corner exclude one another; leave one out")
        if self.centre is not None and not all(abs(at) <= 2**30 for at in self.centre if not isinstance(at, str)):
            raise ValueError(f"centre lies beyond {2**30} tile sides")
        if len(set(self.formats)) < len(self.formats):
            raise ValueError("formats has one twice")
        return self
