"""Classes of the terrain: which material lies at a place, and which Gaussians stay where materials meet.

Every material has a score, and the highest one lies there. Scores are sums of terms at the points of a lattice, or what
a person painted there, and bilinear in between. Where materials meet, their tiles are placed together, and each
Gaussian is kept or dropped by its own score, with fine noise that frays the border and a bonus for what rises above the
ground. All Gaussians at one place see the same scores, and the highest one always passes: the ground has no holes.

docs/formats.md has the formulas. The viewer computes the same scores; tests/golden/classes.json holds both to them.
Only sums, products, quotients, square roots, floor, minima and maxima of float64 are used, in the order written here.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from jaxtyping import Bool, Float, Float32, Int64
from numpy import ndarray as Array

from dav_gswt.bundle.land_cover import MAX_COORDINATE, ClassesEntry, NoiseTerm, RangeTerm
from dav_gswt.terrain.choice import Floats, Ints, hash_cell
from dav_gswt.terrain.heights import SHIFT, FlatSurface, HeightField, gradient_noise, smoothstep

LATTICE = 8  # points of the lattice of scores along a tile's side
MAX_OCTAVES = 8
NOISE = 16  # axis of the hash: octave k of material m uses NOISE + MAX_OCTAVES m + k
JITTER = 80  # octave k uses JITTER + k for the first four materials and JITTER + MAX_OCTAVES + k for the next four
TURN = (0.8, 0.6)  # cosine and sine by which each octave is turned against the last: gradient noise prefers its axes
CONTRAST = 3.0  # the jitter is its noise times this, cut at -1 and 1
FARTHEST = 4.0  # weights by which a score falls at most outside of a range
SLICE = 256  # cells whose scores are computed at once
CACHED = 32768  # cells whose materials are remembered
WIDE = 4 * MAX_COORDINATE  # painted point (i, j) has the key i WIDE + j
SPREAD = (1, 4, 6, 4, 1)  # weights along an axis, by which a painted point counts for those around it
WHOLE = 256  # sum of the products of two weights
REACH = 2  # steps of the lattice to the farthest of them
LEAD = 1.25  # of what is painted over all others, as a multiple of what border effects can change


class Painted:
    """The painted points of a terrain.

    A painted point counts for the points up to two steps around it with the binomial weights SPREAD, so what is painted
    has a smooth border. At a point whose surroundings are painted with a weight, the rule keeps the rest.
    """

    def __init__(self, entry: ClassesEntry):
        # of two runs over a point the later one counts
        points = {(x, j): material for i, j, length, material in entry.painted for x in range(i, i + length)}
        keys = np.array([x * WIDE + j for x, j in points], np.int64)
        order = np.argsort(keys)
        self._keys, self._materials = keys[order], np.array(list(points.values()), np.int64)[order]
        # what is painted exceeds the others by just enough that nothing of them is left
        self._lead = LEAD * (2 * entry.jitter.amplitude + entry.rise.most) or 1.0

    def weights_at(self, i: Ints, j: Ints, materials: int) -> Int64[Array, "n m"]:
        """Weights of the materials painted at and around points, in units of 1 / WHOLE."""
        weights = np.zeros((len(i), materials), np.int64)
        rows = np.flatnonzero(np.maximum(np.abs(i), np.abs(j)) < 2 * MAX_COORDINATE)  # nothing is painted beyond
        for x, y in np.ndindex(len(SPREAD), len(SPREAD)):
            keys = (i[rows] + x - REACH) * WIDE + j[rows] + y - REACH
            at = np.minimum(np.searchsorted(self._keys, keys), len(self._keys) - 1)
            hit = self._keys[at] == keys
            weights[rows[hit], self._materials[at[hit]]] += SPREAD[x] * SPREAD[y]
        return weights

    def apply(self, scores: Float[Array, "n m"], i: Ints, j: Ints) -> Float[Array, "n m"]:
        """Scores at points: what is painted has 0 and all others -lead with its weight, and the rule's scores, less the
        highest and cut at -lead, have the rest. Points without paint keep the rule's scores.
        """
        lead, weights = self._lead, self.weights_at(i, j, scores.shape[1])
        total = weights.sum(1, keepdims=True)
        rest = np.maximum(scores - scores.max(1, keepdims=True), -lead)
        mixed = ((WHOLE - total) * rest - lead * (total - weights)) / WHOLE
        return np.where(total > 0, mixed, scores)


@dataclass(frozen=True)
class Classes:
    """The class function of a terrain.

    Attributes:
        entry: of the manifest.
        materials: number of them.
        side: of a tile.
        heights: the surface, for terms of height and slope.
    """

    entry: ClassesEntry
    materials: int
    side: float
    heights: HeightField = FlatSurface()
    _known: dict[tuple[int, int], int] = field(default_factory=dict, init=False, repr=False)

    def lattice_scores(self, i: Ints, j: Ints) -> Float[Array, "n m"]:
        """Scores of all materials at lattice points; point (i, j) lies at (i, j) side / LATTICE."""
        scores = np.zeros((len(i), self.materials))
        for term in self.entry.rule:
            scores += term.weight * self._evaluate_term(term, i, j)
        return self._painted.apply(scores, i, j) if self.entry.painted else scores

    @cached_property
    def _painted(self) -> Painted:
        return Painted(self.entry)

    def cell_lattices(self, i: Ints, j: Ints) -> Float[Array, "n y x m"]:
        """Scores at the LATTICE + 1 points along each side of cells."""
        steps = np.arange(LATTICE + 1, dtype=np.int64)
        x = np.broadcast_to((i * LATTICE)[:, None, None] + steps, (len(i), LATTICE + 1, LATTICE + 1))
        y = np.broadcast_to((j * LATTICE)[:, None, None] + steps[:, None], x.shape)
        return self.lattice_scores(x.ravel(), y.ravel()).reshape(*x.shape, self.materials)

    def scores_at(self, i: Ints, j: Ints, u: Floats, v: Floats) -> Float[Array, "n m"]:
        """Scores at places u, v in [0, 1] of cells, in tile sides from their south-western corners; without jitter."""
        a, b, s, t = _find_square(u, v)
        x, y = i * LATTICE + a, j * LATTICE + b
        corners = [self.lattice_scores(x + k % 2, y + k // 2) for k in range(4)]
        return _interpolate(corners, s[:, None], t[:, None])

    def jitter_at(self, i: int, j: int, u: Floats, v: Floats) -> Float[Array, "n m"]:
        """Jitter of all materials at places of one cell, at most the amplitude either way.

        It is gradient noise. One hash serves four materials: a byte each, half of it for the gradient's way east and
        half for the way north. Beyond the cell its last square goes on.
        """
        jitter, which = self.entry.jitter, np.arange(self.materials)
        total, gains = np.zeros((len(u), self.materials)), 0.0
        for octave, gain in enumerate(jitter.gains):
            cells, noise = jitter.cells * 2**octave, np.zeros_like(total)
            x, y = cells * u + octave * SHIFT[0], cells * v + octave * SHIFT[1]
            column, row = (np.clip(np.floor(p), 0, cells).astype(np.int64) for p in (x, y))
            s, t = (x - column)[:, None], (y - row)[:, None]
            across, along = smoothstep(s), smoothstep(t)
            for b, a in np.ndindex(2, 2):
                corner = i * cells + column + a, j * cells + row + b
                axes = [JITTER + MAX_OCTAVES * word + octave for word in range((self.materials + 3) // 4)]
                words = np.stack([np.asarray(hash_cell(*corner, axis, self.entry.salt)) for axis in axes], -1)
                bits = words[:, which // 4] >> (8 * (which % 4))
                plane = ((bits & 15) / 7.5 - 1) * (s - a) + ((bits >> 4 & 15) / 7.5 - 1) * (t - b)
                noise += (across if a else 1 - across) * (along if b else 1 - along) * plane
            total, gains = total + gain * noise, gains + gain
        return jitter.amplitude * np.clip(CONTRAST * (total / gains), -1, 1)

    def frayed_scores(self, i: int, j: int, u: Floats, v: Floats) -> Float[Array, "n m"]:
        """Scores at places of one cell, with jitter."""
        lattice, (a, b, s, t) = self.cell_lattices(np.array([i]), np.array([j]))[0], _find_square(u, v)
        corners = [lattice[b + k // 2, a + k % 2] for k in range(4)]
        return _interpolate(corners, s[:, None], t[:, None]) + self.jitter_at(i, j, u, v)

    def materials_in(self, i: Ints, j: Ints) -> Ints:
        """Which materials may have a Gaussian in cells: bit m for material m.

        A difference of scores is bilinear in each square of the lattice, so it is largest at a corner of it; jitter
        changes it by twice the amplitude at most, height by `most`.
        """
        cells = list(zip(i.tolist(), j.tolist(), strict=True))
        if len(self._known) + len(cells) > CACHED:
            self._known.clear()
        new = [cell for cell in dict.fromkeys(cells) if cell not in self._known]
        slack = 2 * self.entry.jitter.amplitude + self.entry.rise.most
        for first in range(0, len(new), SLICE):
            some = new[first : first + SLICE]
            lattices, masks = self.cell_lattices(*np.array(some, np.int64).T), np.zeros(len(some), np.int64)
            for material in range(self.materials):
                most = _most_over_corners(lattices[..., material, None] - lattices)
                masks |= (most >= -slack).all(-1).any(-1).any(-1).astype(np.int64) << material
            self._known.update(zip(some, masks.tolist(), strict=True))
        return np.array([self._known[cell] for cell in cells], np.int64)

    def keep(self, i: int, j: int, means: Float32[Array, "n 3"], material: Ints) -> Bool[Array, "n"]:
        """Which Gaussians of tiles in cell (i, j) stay.

        Args:   means: from the cell's corner. material: of each Gaussian's tile.
        """
        scores = self.frayed_scores(i, j, means[:, 0].astype(float) / self.side, means[:, 1].astype(float) / self.side)
        rise = self.entry.rise
        away = np.abs(means[:, 2].astype(float) - np.array(rise.ground)[material]) - np.array(rise.clearance)[material]
        bonus, rows = np.minimum(rise.slope * np.maximum(away, 0), rise.most), np.arange(len(means))
        mine = scores[rows, material] + bonus
        scores[rows, material] = -np.inf
        return mine >= scores.max(1)

    def _evaluate_term(self, term: NoiseTerm | RangeTerm, i: Ints, j: Ints) -> Float[Array, "n m"]:
        if isinstance(term, NoiseTerm):
            return np.stack([self._class_noise(term, m, i, j) for m in range(self.materials)], 1)
        height, slope = self.heights.at(i * (self.side / LATTICE), j * (self.side / LATTICE))
        value = height if term.kind == "height" else np.sqrt(slope[:, 0] * slope[:, 0] + slope[:, 1] * slope[:, 1])
        low = -np.inf if term.low is None else term.low
        high = np.inf if term.high is None else term.high
        outside = np.maximum(np.maximum(low - value, value - high), 0)
        scores = np.zeros((len(i), self.materials))
        scores[:, term.material] = -np.minimum(outside / term.soft, FARTHEST)
        return scores

    def _class_noise(self, term: NoiseTerm, material: int, i: Ints, j: Ints) -> Floats:
        """Gradient noise of a material at lattice points, in [-1, 1], and its bias."""
        noise, gains = np.zeros(len(i)), 0.0
        step = 1 / (term.wavelengths[material] * LATTICE)
        x, y = i * step, j * step
        for octave, gain in enumerate(term.gains[material]):
            x, y = TURN[0] * x - TURN[1] * y, TURN[1] * x + TURN[0] * y
            axis, place = NOISE + MAX_OCTAVES * material + octave, (x + octave * SHIFT[0], y + octave * SHIFT[1])
            noise += gain * gradient_noise(*place, axis, self.entry.salt)[0]
            x, y, gains = 2 * x, 2 * y, gains + gain
        return noise / gains + term.biases[material]


def _find_square(u: Floats, v: Floats):
    """The square of a cell's lattice under places, and the place in it; beyond the cell the nearest square goes on."""
    x, y = u * LATTICE, v * LATTICE
    a, b = (np.clip(np.floor(p), 0, LATTICE - 1).astype(np.int64) for p in (x, y))
    return a, b, x - a, y - b


def _interpolate(corners: Sequence[Float[Array, "n m"]], s: Float[Array, "n 1"], t: Float[Array, "n 1"]) -> Array:
    """Between the south-western, south-eastern, north-western and north-eastern corner of a square."""
    south, north = (left + s * (right - left) for left, right in (corners[:2], corners[2:]))
    return south + t * (north - south)


def _most_over_corners(values: Float[Array, "n y x m"]) -> Float[Array, "n b a m"]:
    """Maximum over the four corners of every square."""
    rows = np.maximum(values[:, 1:], values[:, :-1])
    return np.maximum(rows[:, :, 1:], rows[:, :, :-1])
