"""Scatter: where objects stand on the endless terrain, as a pure function of the cell.

A grid of `cells` x `cells` squares a tile holds one candidate each, at a place by hash. A candidate becomes one of the
objects of the material under it by a second hash, or none. It stands if its footprint lies well inside that material,
and if its priority, a third hash, is the highest of all candidates whose footprints overlap it, whether or not those
stand themselves (Matern's second hard-core process). So no two overlap, every place is decided by the squares around
it, and since places are uniform in their squares, no lattice shows in their density.

The viewer computes the same instances; tests/golden/scatter.json holds both to them. Only sums, products, quotients and
floor of float64 are used.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, fields

import numpy as np
from jaxtyping import Bool, Float, Int64
from numpy import ndarray as Array
from scipy.spatial import cKDTree

from dav_gswt.bundle.land_cover import ObjectOrders, ScatterEntry
from dav_gswt.terrain.choice import hash_cell
from dav_gswt.terrain.classes import Classes

PLACE, WHICH, PRIORITY, FORM = 96, 97, 98, 99  # axes of the hash
CACHED = 32768  # cells whose instances are kept
RIM = ((1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.0, -1.0))  # where a footprint is tested against its material


@dataclass(frozen=True)
class Instances:
    """Objects on the terrain.

    Attributes:
        i, j: cell of the foot.
        u, v: place of the foot in its cell, in tile sides.
        number: which object.
        turn: counter-clockwise, in degrees.
        size: factor.
    """

    i: Int64[Array, "n"]
    j: Int64[Array, "n"]
    u: Float[Array, "n"]
    v: Float[Array, "n"]
    number: Int64[Array, "n"]
    turn: Float[Array, "n"]
    size: Float[Array, "n"]

    def __len__(self) -> int:
        return len(self.i)

    def __getitem__(self, index) -> "Instances":
        return Instances(*(getattr(self, f.name)[index] for f in fields(self)))


_NONE = np.zeros(0, np.int64)
EMPTY = Instances(_NONE, _NONE, np.zeros(0), np.zeros(0), _NONE, np.zeros(0), np.zeros(0))


def concatenate_instances(parts: Sequence[Instances]) -> Instances:
    """All instances of all parts, in their order."""
    return Instances(*(np.concatenate([getattr(part, f.name) for part in (EMPTY, *parts)]) for f in fields(Instances)))


@dataclass(frozen=True)
class Scatter:
    """The scatter of a terrain.

    Attributes:
        entry: of the manifest.
        objects: of the manifest.
        side: of a tile.
        classes: which material lies where; None with one.
    """

    entry: ScatterEntry
    objects: Sequence[ObjectOrders]
    side: float
    classes: Classes | None = None
    _known: dict[tuple[int, int], Instances] = field(default_factory=dict, init=False, repr=False)

    def instances_in(self, i: Int64[Array, "n"], j: Int64[Array, "n"]) -> Instances:
        """The objects whose feet lie in cells, cell by cell."""
        cells = list(zip(i.tolist(), j.tolist(), strict=True))
        if len(self._known) + len(cells) > CACHED:
            self._known.clear()
        if new := [cell for cell in dict.fromkeys(cells) if cell not in self._known]:
            found = self._find_instances(np.array(new, np.int64))
            index = {cell: number for number, cell in enumerate(new)}
            owner = np.array([index[cell] for cell in zip(found.i.tolist(), found.j.tolist(), strict=True)], int)
            order = np.argsort(owner, kind="stable")
            ends = np.cumsum(np.bincount(owner, minlength=len(new)))
            for cell, rows in zip(new, np.split(order, ends[:-1]), strict=True):
                self._known[cell] = found[rows]
        return concatenate_instances([self._known[cell] for cell in cells])

    def _find_instances(self, cells: Int64[Array, "n 2"]) -> Instances:
        """All instances in distinct cells, by candidates in them and in the cells around."""
        n, widest = self.entry.cells, 2 * max(each.radius for each in self.objects) * (1 + self.entry.size)
        ring = -(-int(np.ceil(widest * n / self.side)) // n)  # cells around whose candidates may overlap one inside
        around = np.stack(np.meshgrid(*2 * [np.arange(-ring, ring + 1)]), -1).reshape(-1, 2)
        wide = np.unique((cells[:, None] + around[None]).reshape(-1, 2), axis=0)
        squares = np.stack(np.meshgrid(np.arange(n), np.arange(n)), -1).reshape(-1, 2)
        a, b = (wide[:, None] * n + squares[None]).reshape(-1, 2).T
        a, b, found = self._find_candidates(a, b)
        stands = self._has_priority(a, b, found)
        wanted = set(map(tuple, cells.tolist()))
        inside = [cell in wanted for cell in zip(found.i.tolist(), found.j.tolist(), strict=True)]
        return found[stands & np.array(inside, bool)]

    def _find_candidates(
        self, a: Int64[Array, "n"], b: Int64[Array, "n"]
    ) -> tuple[Int64[Array, "k"], Int64[Array, "k"], Instances]:
        """Candidates of squares that are an object whose footprint lies inside its material, and their squares."""
        entry = self.entry
        chance = self._hash(a, b, WHICH) / 4294967296.0
        some = chance < max(self._thresholds(m)[-1] for m in range(self._materials))
        a, b, chance = a[some], b[some], chance[some]
        place, form = self._hash(a, b, PLACE), self._hash(a, b, FORM)
        i, j = a // entry.cells, b // entry.cells
        u = ((a - i * entry.cells) + ((place & 0xFFFF) + 0.5) / 65536.0) / entry.cells
        v = ((b - j * entry.cells) + ((place >> 16) + 0.5) / 65536.0) / entry.cells
        size = 1 + entry.size * ((form & 0xFFFF) / 32767.5 - 1)
        turn = entry.turn * ((form >> 16) / 32767.5 - 1)
        material = self._find_material(i, j, u, v)
        number = self._choose_object(material, chance)
        found, rows = Instances(i, j, u, v, number, turn, size), np.flatnonzero(number >= 0)
        rows = rows[self._lies_inside(found[rows], material[rows])]
        return a[rows], b[rows], found[rows]

    def _hash(self, a: Int64[Array, "n"], b: Int64[Array, "n"], axis: int) -> Int64[Array, "n"]:
        return np.asarray(hash_cell(a, b, axis, self.entry.salt))

    @property
    def _materials(self) -> int:
        return 1 if self.classes is None else self.classes.materials

    def _thresholds(self, material: int) -> Float[Array, "k"]:
        """Upper bounds of the hash, in [0, 1], by object; the bound of one of another material is that before it."""
        return np.cumsum([each.probability * (each.material == material) for each in self.objects])

    def _choose_object(self, material: Int64[Array, "n"], chance: Float[Array, "n"]) -> Int64[Array, "n"]:
        """Number of the object that each candidate is; -1: none."""
        bounds = np.stack([self._thresholds(m) for m in range(self._materials)])[material]
        below = chance[:, None] < bounds
        return np.where(below.any(1), below.argmax(1), -1)

    def _find_material(self, i: Array, j: Array, u: Array, v: Array) -> Int64[Array, "n"]:
        """The material with the highest score at places, of equals the first."""
        material = np.zeros(len(i), np.int64)
        if self.classes is not None:
            bits = self.classes.materials_in(i, j)
            for m in range(self._materials):
                material[bits == 1 << m] = m
            mixed = np.flatnonzero(bits & (bits - 1))
            material[mixed] = self.classes.scores_at(i[mixed], j[mixed], u[mixed], v[mixed]).argmax(1)
        return material

    def _lies_inside(self, found: Instances, material: Int64[Array, "n"]) -> Bool[Array, "n"]:
        """Whether the score of the material exceeds the others by the jitter's amplitude in four places of the rim."""
        inside = np.ones(len(found), bool)
        if self.classes is None:
            return inside
        radius = np.array([each.radius for each in self.objects])[found.number] * found.size / self.side
        for east, north in RIM:
            x, y = found.u + east * radius, found.v + north * radius
            right, up = np.floor(x), np.floor(y)
            i, j = found.i + right.astype(np.int64), found.j + up.astype(np.int64)
            test = np.flatnonzero(inside & (self.classes.materials_in(i, j) != 1 << material))
            scores = self.classes.scores_at(i[test], j[test], (x - right)[test], (y - up)[test])
            own = scores[np.arange(len(test)), material[test]]
            scores[np.arange(len(test)), material[test]] = -np.inf
            inside[test] = own - scores.max(1) >= self.classes.entry.jitter.amplitude
        return inside

    def _has_priority(self, a: Int64[Array, "n"], b: Int64[Array, "n"], found: Instances) -> Bool[Array, "n"]:
        """Whether no candidate of a higher priority overlaps; of equal priorities the one farther east, then north."""
        stands = np.ones(len(found), bool)
        if len(found) < 2:
            return stands
        square = self.side / self.entry.cells
        radius = np.array([each.radius for each in self.objects])[found.number] * found.size
        place = self._hash(a, b, PLACE)
        x, y = ((place & 0xFFFF) + 0.5) / 65536.0, ((place >> 16) + 0.5) / 65536.0
        rough = np.stack([(a - a[0]) + x, (b - b[0]) + y], 1) * square
        first, second = cKDTree(rough).query_pairs(2.001 * radius.max(), output_type="ndarray").T
        dx = ((a[first] - a[second]) + (x[first] - x[second])) * square
        dy = ((b[first] - b[second]) + (y[first] - y[second])) * square
        reach = radius[first] + radius[second]
        overlap = dx * dx + dy * dy < reach * reach
        first, second = first[overlap], second[overlap]
        priority = self._hash(a, b, PRIORITY)
        keys = np.stack([priority, a, b], 1)
        difference = keys[first] - keys[second]
        leading = difference[np.arange(len(first)), (difference != 0).argmax(1)]
        stands[np.where(leading > 0, second, first)] = False
        return stands
