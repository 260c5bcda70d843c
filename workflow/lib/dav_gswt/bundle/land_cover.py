"""Entries of the manifest that say which material lies where, where objects stand, how colours vary, and where the sun
stood.

`terrain.classes`, `terrain.scatter` and `terrain.variation` compute from them; docs/formats.md says what each key means
and has the formulas.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import Annotated, Literal

from pydantic import Field

from dav_gswt.bundle.encoding import Entry, Length, Natural, Pair, Share, Size
from dav_gswt.bundle.parts import ChunkEntry

MAX_PAINTED = 2**18  # points
MAX_COORDINATE = 2**23  # of a painted point

Gains = Annotated[list[Share], Field(min_length=1, max_length=8)]
Pixels = Annotated[int, Field(ge=1, le=4096)]
Salt = Annotated[int, Field(ge=0, lt=2**32)]
Name = Annotated[str, Field(min_length=1, max_length=80)]
Change = Annotated[list[Annotated[float, Field(ge=-1, le=1)]], Field(min_length=3, max_length=3)]


@dataclass(frozen=True)
class NoiseTerm:
    """A term of the rule of classes: gradient noise whose classes have the materials' shares.

    A material's noise has its wavelength and gains of its octaves, the widest first.
    """

    kind: Literal["noise"]
    weight: Size
    wavelengths: list[Length]
    gains: list[Gains]
    biases: list[float]


@dataclass(frozen=True)
class RangeTerm:
    """A term of the rule of classes: a material is found where the surface's height or slope lies in a range."""

    kind: Literal["height", "slope"]
    weight: Size
    material: Natural
    low: float | None
    high: float | None
    soft: Length


@dataclass(frozen=True)
class JitterEntry(Entry):
    """Fine noise that frays the borders of classes: its widest octave has `cells` cells along a tile's side, each next
    one twice as many, and they count by their gains; scores change by `amplitude` at most.
    """

    cells: Pixels
    gains: Gains
    amplitude: Size


@dataclass(frozen=True)
class RiseEntry(Entry):
    """How far what rises above the ground reaches over a border of classes."""

    slope: Size
    most: Size
    ground: list[float]
    clearance: list[Size]


RuleTerm = Annotated[NoiseTerm | RangeTerm, Field(discriminator="kind")]


@dataclass(frozen=True)
class ClassesEntry(Entry):
    """Which material lies where: a sum of terms, and the transition between two materials."""

    salt: Salt
    rule: Annotated[list[RuleTerm], Field(min_length=1, max_length=64)]
    jitter: JitterEntry
    rise: RiseEntry
    painted: Annotated[list[list[int]], Field(max_length=MAX_PAINTED)] = field(default_factory=list)

    def find_faults(self, materials: int) -> Iterator[str]:
        """What does not fit a number of materials."""
        lists, gains = [self.rise.ground, self.rise.clearance], [self.jitter.gains]
        for term in self.rule:
            if isinstance(term, NoiseTerm):
                lists += [term.wavelengths, term.gains, term.biases]
                gains += term.gains
            elif isinstance(term, RangeTerm) and term.material >= materials:
                yield "a term is of a material that is not there"
        if not all(sum(each) for each in gains):
            yield "all gains of a noise are 0"
        if any(len(values) != materials for values in lists):
            yield f"a list does not have one value for each of {materials} materials"
        if fault := find_run_fault(self.painted, materials):
            yield f"painted: {fault}"


def find_run_fault(runs: Sequence[Sequence[int]], materials: int) -> str | None:
    """What makes no sense in runs [I, J, length, material] of painted points; None: nothing."""
    if any(len(run) != 4 for run in runs):
        return "a run is not four numbers"
    if sum(run[2] for run in runs) > MAX_PAINTED:
        return f"more than {MAX_PAINTED} places"
    for i, j, length, material in runs:
        if not (length > 0 and abs(i) < MAX_COORDINATE and abs(j) < MAX_COORDINATE and i + length < MAX_COORDINATE):
            return "a run beyond the bounds"
        if not 0 <= material < materials:
            return "a material that is not there"
    return None


@dataclass(frozen=True)
class ObjectEntry(Entry):
    """An object on the terrain. orders: the directions in whose orders it is drawn."""

    name: Name
    radius: Length
    z: Pair
    ground: float
    material: Natural
    density: Size
    probability: Share
    orders: Annotated[list[Natural], Field(min_length=1)]
    chunks: Annotated[Sequence[ChunkEntry], Field(min_length=1)]


@dataclass(frozen=True)
class ScatterEntry(Entry):
    """Where objects stand."""

    cells: Annotated[int, Field(ge=1, le=64)]
    turn: Annotated[float, Field(ge=0, le=180)]
    size: Annotated[float, Field(ge=0, lt=1)]
    salt: Salt


@dataclass(frozen=True)
class WaveEntry(Entry):
    """A wave of the variation: noise whose cells are `wavelength` tile sides wide, and of each material what noise of 1
    adds to its red, green and blue.
    """

    wavelength: Annotated[float, Field(ge=0.01, le=1e4)]
    colours: Annotated[list[Change], Field(min_length=1, max_length=8)]


@dataclass(frozen=True)
class LightEntry(Entry):
    """The captured sun, whose light the colours contain: degrees above the horizon and clockwise from the tiles' +y.

    source: the config, the photos' EXIF, the shading of the relief, or nothing (a guess). north: azimuth of +y itself,
    clockwise from true north; 0 if north is not known.
    """

    elevation: Annotated[float, Field(ge=3, le=90)]
    azimuth: Annotated[float, Field(ge=0, lt=360)]
    source: Literal["config", "exif", "relief", "assumed"]
    north: Annotated[float, Field(ge=0, lt=360)] = 0.0


ASSUMED_SUN = 45.0, 225.0  # elevation, and azimuth from north, of a sun that nothing reveals: in the south-west
