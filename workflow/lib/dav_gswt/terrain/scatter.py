"""Scatter: where objects stand on the endless terrain, as a pure function of the cell.

Every square of a grid has one candidate, at a place by hash. A candidate stands if its footprint lies well inside its
material, and if its priority is the highest of all candidates whose footprints overlap it, whether or not those stand
themselves (Matern's second hard-core process). So every place is decided by the squares around it.

docs/formats.md has the formulas. The viewer computes the same instances; tests/golden/scatter.json holds both to them.
Only sums, products, quotients and floor of float64 are used.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Bool, Float, Int64
from numpy import ndarray as Array
from scipy.spatial import cKDTree

from dav_gswt.bundle.land_cover import ObjectEntry, ScatterEntry
from dav_gswt.field import Rows
from dav_gswt.terrain.choice import Floats, Ints, hash_cell
from dav_gswt.terrain.classes import Classes

PLACE, WHICH, PRIORITY, FORM = 96, 97, 98, 99  # axes of the hash
CACHED = 32768  # cells whose instances are kept
RIM = ((1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.0, -1.0))  # where a footprint is tested against its material


@dataclass(frozen=True)
class Instances(Rows):
    """Objects on the terrain.

    Attributes:
        i, j: cell of the foot.
        u, v: place of the foot in its cell, in tile sides.
        number: which object.
        turn: counter-clockwise, in degrees.
        size: factor.
    """

    i: Ints
    j: Ints
    u: Floats
    v: Floats
    number: Ints
    turn: Floats
    size: Floats


NONE = Instances(*(np.zeros(0, kind) for kind in (int, int, float, float, int, float, float)))


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
    objects: Sequence[ObjectEntry]
    side: float
    classes: Classes | None = None
    _known: dict[tuple[int, int], Instances] = field(default_factory=dict, init=False, repr=False)

    def instances_in(self, i: Ints, j: Ints) -> Instances:
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
        return Instances.concatenate([NONE, *(self._known[cell] for cell in cells)])

    def _find_instances(self, cells: Int64[Array, "n 2"]) -> Instances:
        """All instances in distinct cells, by candidates in them and in the cells around."""
        n, entry, widest = self.entry.cells, self.entry, 2 * max(each.radius for each in self.objects)
        ring = -(-int(np.ceil(widest * (1 + entry.size) * n / self.side)) // n)  # farther candidates do not overlap
        around = np.stack(np.meshgrid(*2 * [np.arange(-ring, ring + 1)]), -1).reshape(-1, 2)
        wide = np.unique((cells[:, None] + around[None]).reshape(-1, 2), axis=0)
        squares = np.stack(np.meshgrid(np.arange(n), np.arange(n)), -1).reshape(-1, 2)
        a, b = (wide[:, None] * n + squares[None]).reshape(-1, 2).T
        bounds = np.stack(  # upper ones of the hash, by material and object
            [np.cumsum([each.probability * (each.material == m) for each in self.objects]) for m in self._materials]
        )
        chance = self._hash(a, b, WHICH) / 4294967296.0
        some = chance < bounds.max()
        a, b, chance = a[some], b[some], chance[some]
        place, form = self._hash(a, b, PLACE), self._hash(a, b, FORM)
        x, y = ((place & 0xFFFF) + 0.5) / 65536.0, ((place >> 16) + 0.5) / 65536.0
        i, j = a // n, b // n
        u, v = ((a - i * n) + x) / n, ((b - j * n) + y) / n
        size = 1 + entry.size * ((form & 0xFFFF) / 32767.5 - 1)
        turn = entry.turn * ((form >> 16) / 32767.5 - 1)
        material = self._find_material(i, j, u, v)
        below = chance[:, None] < bounds[material]
        found, rows = Instances(i, j, u, v, below.argmax(1), turn, size), np.flatnonzero(below.any(1))
        rows = rows[self._lies_inside(found[rows], material[rows])]
        found = found[rows]
        stands = self._has_priority(a[rows], b[rows], np.stack([x, y], 1)[rows], self.radii(found))
        wanted = set(map(tuple, cells.tolist()))
        inside = [cell in wanted for cell in zip(found.i.tolist(), found.j.tolist(), strict=True)]
        return found[stands & np.array(inside, bool)]

    def radii(self, found: Instances) -> Floats:
        """The radii of footprints."""
        return np.array([each.radius for each in self.objects])[found.number] * found.size

    def _hash(self, a: Ints, b: Ints, axis: int) -> Ints:
        return np.asarray(hash_cell(a, b, axis, self.entry.salt))

    @property
    def _materials(self) -> range:
        return range(1 if self.classes is None else self.classes.materials)

    def _find_material(self, i: Ints, j: Ints, u: Floats, v: Floats) -> Ints:
        """The material with the highest score at places, of equals the first."""
        material = np.zeros(len(i), np.int64)
        if self.classes is not None:
            bits = self.classes.materials_in(i, j)
            for m in self._materials:
                material[bits == 1 << m] = m
            mixed = np.flatnonzero(bits & (bits - 1))
            material[mixed] = self.classes.scores_at(i[mixed], j[mixed], u[mixed], v[mixed]).argmax(1)
        return material

    def _lies_inside(self, found: Instances, material: Ints) -> Bool[Array, "n"]:
        """Whether the score of the material exceeds the others by the jitter's amplitude in four places of the rim."""
        inside = np.ones(len(found), bool)
        if self.classes is None:
            return inside
        radius = self.radii(found) / self.side
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

    def _has_priority(self, a: Ints, b: Ints, place: Float[Array, "n 2"], radius: Floats) -> Bool[Array, "n"]:
        """Whether no candidate of a higher priority overlaps; of equal priorities the one farther east, then north.

        a, b: squares of the grid. place: in the square, in its sides.
        """
        stands = np.ones(len(a), bool)
        if len(a) < 2:
            return stands
        square = self.side / self.entry.cells
        rough = (np.stack([a - a[0], b - b[0]], 1) + place) * square
        first, second = cKDTree(rough).query_pairs(2.001 * radius.max(), output_type="ndarray").T
        way = np.stack([a[first] - a[second], b[first] - b[second]], 1)
        dx, dy = ((way + (place[first] - place[second])) * square).T
        reach = radius[first] + radius[second]
        overlap = dx * dx + dy * dy < reach * reach
        first, second = first[overlap], second[overlap]
        keys = np.stack([self._hash(a, b, PRIORITY), a, b], 1)
        difference = keys[first] - keys[second]
        leading = difference[np.arange(len(first)), (difference != 0).argmax(1)]
        stands[np.where(leading > 0, second, first)] = False
        return stands
