"""Entries of the manifest that say which material lies where, where objects stand, how colours vary, and where the sun
stood.

`terrain.classes`, `terrain.scatter` and `terrain.variation` compute from them; docs/formats.md has the formulas.
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

    Attributes:
        kind: always `noise`.
        weight: factor of the value.
        wavelengths: for each material, the width of the cells of its noise, in tile sides.
        gains: for each material, the weights of the octaves of its noise, the widest first; not all 0.
        biases: for each material, the number that is added to its noise.
    """

    kind: Literal["noise"]
    weight: Size
    wavelengths: list[Length]
    gains: list[Gains]
    biases: list[float]


@dataclass(frozen=True)
class RangeTerm:
    """A term of the rule of classes: a material is found where the surface's height or slope lies in a range.

    Attributes:
        kind: the quantity that must lie in the range.
        weight: factor of the value.
        material: number of the material.
        low: lower bound of the range; null: none.
        high: upper bound of the range; null: none.
        soft: how far beyond a bound the value falls by 1.
    """

    kind: Literal["height", "slope"]
    weight: Size
    material: Natural
    low: float | None
    high: float | None
    soft: Length


@dataclass(frozen=True)
class JitterEntry(Entry):
    """Fine noise that frays the borders between materials.

    Attributes:
        cells: number of noise cells of the widest octave along a tile's side. Each further octave has twice as many.
        gains: weights of the octaves, the widest first; not all 0.
        amplitude: largest change of a score, either way.
    """

    cells: Pixels
    gains: Gains
    amplitude: Size


@dataclass(frozen=True)
class RiseEntry(Entry):
    """How far things that rise above the ground reach over a border between materials.

    Attributes:
        slope: increase of the score per unit of height beyond the clearance.
        most: largest increase of the score.
        ground: for each material, z of the ground in its tiles.
        clearance: for each material, the distance from its ground, up or down, from which heights count.
    """

    slope: Size
    most: Size
    ground: list[float]
    clearance: list[Size]


RuleTerm = Annotated[NoiseTerm | RangeTerm, Field(discriminator="kind")]


@dataclass(frozen=True)
class ClassesEntry(Entry):
    """Which material lies where: at each place, the one with the highest score.

    Attributes:
        salt: salt of all hashes that the scores use.
        rule: terms whose sum is the score.
        jitter: noise that frays the borders.
        rise: how far things that rise above the ground reach over a border.
        painted: runs [I, J, n, m] of painted points, from (I, J) to (I + n - 1, J), with material m. Only in the
            manifest of a page.
    """

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
    """A kind of object that stands on the terrain in many copies.

    Attributes:
        name: name of the object.
        radius: radius of the disc on which it stands, its footprint.
        z: lowest and highest z of its Gaussians at any level, out to three standard deviations, measured from the foot.
        ground: height (z) of the foot in a tile.
        material: number of the material on which it stands.
        density: wanted number of objects per unit of area of that material.
        probability: probability that a candidate place on that material has this object.
        orders: the draw orders to use, as different indices into `directions`.
        chunks: one chunk for each level, finest first. All are stored.
    """

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
    """Where objects stand.

    Attributes:
        cells: squares along a tile's side, each with one candidate place.
        turn: largest turn of an object about the vertical, either way, in degrees.
        size: largest change of an object's size, either way, as a share of the size.
        salt: salt of the hashes that place objects.
    """

    cells: Annotated[int, Field(ge=1, le=64)]
    turn: Annotated[float, Field(ge=0, le=180)]
    size: Annotated[float, Field(ge=0, lt=1)]
    salt: Salt


@dataclass(frozen=True)
class WaveEntry(Entry):
    """A wave of the variation: noise that adds large-scale light and dark to the tiles.

    Attributes:
        wavelength: width of the noise's cells, in tile sides.
        colours: for each material, the change of red, green and blue where the noise is 1.
    """

    wavelength: Annotated[float, Field(ge=0.01, le=1e4)]
    colours: Annotated[list[Change], Field(min_length=1, max_length=8)]


@dataclass(frozen=True)
class LightEntry(Entry):
    """The captured sun, whose light the colours contain.

    Attributes:
        elevation: degrees above the horizon.
        azimuth: degrees, clockwise from the +y axis.
        source: how the position is known: from the config, the photos' EXIF or the shading of the relief; `assumed`
            is a guess.
        north: azimuth of the +y axis, clockwise from true north; 0 if unknown.
    """

    elevation: Annotated[float, Field(ge=3, le=90)]
    azimuth: Annotated[float, Field(ge=0, lt=360)]
    source: Literal["config", "exif", "relief", "assumed"]
    north: Annotated[float, Field(ge=0, lt=360)] = 0.0


ASSUMED_SUN = 45.0, 225.0  # elevation, and azimuth from north, of a sun that nothing reveals: in the south-west
