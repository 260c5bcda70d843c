"""What was chosen when a tile set was cut, and what it cost: the content of seams.json."""

from dataclasses import asdict, dataclass, field, fields
from typing import Any

from dav_gswt.tiles.energy import LayerScales
from dav_gswt.tiles.layout import Layout, PatchPlaces


@dataclass(frozen=True)
class PlacesReport:
    """`layout.PatchPlaces` as lists."""

    corner: list[int]
    vertical: list[list[int]]
    horizontal: list[list[int]]
    centres: list[list[int]]

    @classmethod
    def from_places(cls, places: PatchPlaces) -> "PlacesReport":
        return cls(**{own.name: getattr(places, own.name).tolist() for own in fields(cls)})


@dataclass(frozen=True)
class EnergyReport:
    """What seams were priced by (`energy.SeamEnergy`).

    Attributes:
        kind: one of `energy.KINDS`.
        scales: of the layers, by name.
        eps: `energy.EPS`.
        standing: weight of cells that are hidden by occluders; None where there are none.
        gamma, slope: a constant weight of colour, or the slope of the weight's function of uncertainty.
        semantics: what the semantic layer was made of; None without one.
    """

    kind: str
    scales: dict[str, LayerScales]
    eps: float
    standing: float | None = None
    gamma: float | None = None
    slope: float | None = None
    semantics: dict[str, Any] | None = None

    def to_dict(self) -> dict[str, Any]:
        return {name: value for name, value in asdict(self).items() if value is not None}

    @classmethod
    def from_dict(cls, value: dict[str, Any]) -> "EnergyReport":
        scales = {name: LayerScales(**unit) for name, unit in value["scales"].items()}
        parts: dict[str, Any] = value | {"scales": scales}
        return cls(**parts)


@dataclass(frozen=True)
class TileReport:
    """The content of seams.json under `seams`.

    Attributes:
        places: of the patches in the exemplar.
        strip_energy, strip_gamma: cost of the seam and weight of colour, of vertical strips 0, 1 and horizontal 0, 1.
        tile_energy, tile_gamma: the same of every tile's centre.
        layout: sizes in cells.
        texture: scale of the exemplar's texture, in world units.
        raised: height that was added to the middle of each tile.
        energy: what seams were priced by.
        trend: range of the trend that was removed, of `colour` and `height`.
        correction: largest correction of red, green, blue and height.
        more: what a study adds, by key.
    """

    places: PlacesReport
    strip_energy: list[float]
    strip_gamma: list[float]
    tile_energy: list[float]
    tile_gamma: list[float]
    layout: Layout
    texture: float
    raised: list[float]
    energy: EnergyReport
    trend: dict[str, float]
    correction: list[float]
    more: dict[str, Any] = field(default_factory=dict)

    def to_dict(self) -> dict[str, Any]:
        """The JSON object."""
        value = {own.name: getattr(self, own.name) for own in fields(self) if own.name != "more"}
        parts = {"places": asdict(self.places), "layout": self.layout.to_dict(), "energy": self.energy.to_dict()}
        return value | parts | self.more

    @classmethod
    def from_dict(cls, value: dict[str, Any]) -> "TileReport":
        """The report of a JSON object. Raises: KeyError, TypeError: a key is missing or not known."""
        own = {name: value[name] for name in [f.name for f in fields(cls) if f.name != "more"]}
        parts = {
            "places": PlacesReport(**value["places"]),
            "layout": Layout.from_dict(value["layout"]),
            "energy": EnergyReport.from_dict(value["energy"]),
            "more": {name: part for name, part in value.items() if name not in own},
        }
        return cls(**own | parts)
