"""Choose the places of the exemplar that become patches: cheap seams, well known ground, little repetition.

Every search draws candidate places with the generator passed in, drops those over uncertain ground where others exist,
and ranks the rest by the mean squared difference in the zone where the seam may run, in units of the candidates'
median, plus a charge for ground that other patches show already.
"""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float, Int
from numpy import ndarray as Array
from scipy.ndimage import gaussian_filter

from dav_gswt.tiles.energy import safe_unit
from dav_gswt.tiles.layout import Layout

UNCERTAINTY_MARGIN = 0.05  # of mean uncertainty above the least candidate's: still accepted
REPEAT_COST = 0.5  # charge for ground shown twice, a median seam's cost
FIT_FACTOR = 1.75  # times the best seam's cost: accepted as well
OUTLIER = 2.0  # times the mean squared distance from the median colour: beyond it a cell is no grain
NEAR_SHARE = 0.25  # of a patch's shorter side: places that are nearer show nearly the same
SAMPLES = 3000  # cells of a seam zone that are compared
OVERLAY_SAMPLES = 64  # samples along a tile's side, of repetition
LINE_WEIGHT = 4.0  # cost of lines over the cost of other repetition
SPOTS = (1 / 80, 1 / 20), (1 / 24, 1 / 8)  # of a tile's side: two blurs each, whose difference shows landmarks
OUTSTANDING = 10.0  # times the median squared difference of these: beyond it a cell belongs to a landmark
INVISIBLE = (1 / 255) ** 2  # squared difference that nobody sees
LANDMARK_COST = 1.0  # of a strip with the exemplar's share of landmarks, where a median seam costs 1

UsedPatch = tuple[Array, tuple[int, int]]  # a place (x, y) and a size (width, height)


@dataclass(frozen=True)
class GuidanceMaps:
    """Per finest cell of the exemplar: features that patches are matched by, uncertainty in [0, 1], and landmarks
    (`find_landmarks`).
    """

    features: Float[Array, "m m k"]
    uncertainty: Float[Array, "m m"]
    landmarks: Float[Array, "m m"]


def make_guidance(
    colour: Float[Array, "m m 3"], height: Float[Array, "m m"], uncertainty: Float[Array, "m m"], layout: Layout
) -> GuidanceMaps:
    """Features: colour, its average over a quarter strip (the eye finds a step of brightness before a broken grain),
    and height over its own spread, as much as one channel of colour.
    """
    width = layout.strip / 4
    soft = np.stack([gaussian_filter(colour[..., c], width, mode="nearest") for c in range(3)], -1)
    spread = float(colour.std(axis=(0, 1)).mean())
    relief = height - gaussian_filter(height, layout.side / 3, mode="nearest")
    height = relief * (spread / (relief.std() or 1.0))
    landmarks = find_landmarks(np.concatenate([colour, height[..., None]], -1), layout.side)
    return GuidanceMaps(np.concatenate([colour, 2 * soft, height[..., None]], -1), uncertainty, landmarks)


def find_landmarks(maps: Float[Array, "m m k"], side: int) -> Float[Array, "m m"]:
    """Cells that stand out of their surroundings, each as 1 over the share of such cells; 0 for the others.

    What repeats is seen from where a terrain is seen to repeat, so a landmark's size is a share of a tile's `side`.
    """
    found = np.zeros(maps.shape[:2], bool)
    for blurs in SPOTS:
        near, around = (gaussian_filter(maps, (b * side, b * side, 0), mode="nearest", truncate=2) for b in blurs)
        away = ((near - around) ** 2).sum(-1)
        found |= away > OUTSTANDING * max(float(np.median(away)), INVISIBLE)
    return found / safe_unit(float(found.mean()))


def list_places(layout: Layout, size: tuple[int, int]) -> Int[Array, "n 2"]:
    """All places (x, y) for a patch of `size` (width, height) cells, on the coarsest grid."""
    columns, rows = ((layout.exemplar - s) // layout.block + 1 for s in size)
    number = np.arange(columns * rows)
    return np.stack([number % columns, number // columns], 1) * layout.block


def draw_places(places: Int[Array, "n 2"], count: int, rng: np.random.Generator) -> Int[Array, "m 2"]:
    """At most `count` different ones of these places."""
    return places[rng.permutation(len(places))[:count]] if len(places) > count else places


def patch_means(values: Float[Array, "m m"], places: Int[Array, "n 2"], size: tuple[int, int]) -> Float[Array, "n"]:
    """Mean of a map over a patch of `size` at each place."""
    width, height = size
    return box_sums(values, height, width)[places[:, 1], places[:, 0]] / (width * height)


def box_sums(values: Array, rows: int, columns: int) -> Array:
    """Sum over the box of `rows` x `columns` cells from each cell to the north-east that fits the map."""
    total = np.zeros((values.shape[0] + 1, values.shape[1] + 1), np.float64 if values.dtype.kind == "f" else np.int64)
    np.cumsum(values, 0, out=total[1:, 1:])
    np.cumsum(total[1:, 1:], 1, out=total[1:, 1:])
    return total[rows:, columns:] - total[:-rows, columns:] - total[rows:, :-columns] + total[:-rows, :-columns]


def keep_certain(guide: GuidanceMaps, places: Int[Array, "n 2"], size: tuple[int, int]) -> Int[Array, "m 2"]:
    """The places whose mean uncertainty is about the least."""
    uncertainty = patch_means(guide.uncertainty, places, size)
    return places[uncertainty <= uncertainty.min() + UNCERTAINTY_MARGIN]


def overlap_share(
    places: Int[Array, "n 2"], size: tuple[int, int], other: Int[Array, "2"], other_size: tuple[int, int]
) -> Float[Array, "n"]:
    """Ground that patches share with another one, as a share of the smaller of the two."""
    low, high = np.maximum(places, other), np.minimum(places + size, np.asarray(other) + other_size)
    return np.maximum(high - low, 0).prod(1) / min(np.prod(size), np.prod(other_size))


def compute_saliency(guide: GuidanceMaps) -> Float[Array, "m m"]:
    """How conspicuous each cell is against the whole exemplar.

    The squared distance of its soft colour from the median one, over that distance's mean, plus a quarter of its
    square, so that one conspicuous bush weighs more than many pale shades. Grain counts only beyond OUTLIER times its
    mean: a white twig is a landmark, but among trees the least conspicuous ground is more trees, not the one bare spot.
    """

    def distance_from_median(values: Array) -> Array:
        distance = ((values - np.median(values, axis=(0, 1))) ** 2).sum(-1)
        return distance / (distance.mean() or 1.0)

    grain, soft = (distance_from_median(guide.features[..., part]) for part in (np.s_[:3], np.s_[3:6]))
    return soft + 0.25 * soft**2 + 0.25 * np.maximum(grain - OUTLIER, 0) ** 2


def patch_saliency(guide: GuidanceMaps, places: Int[Array, "n 2"], size: tuple[int, int]) -> Float[Array, "n"]:
    """Mean saliency of a patch at each place, at least the places' median.

    A strip with a landmark becomes a row of landmarks. A strip that is plainer than the median becomes a bare line
    along every border, which is visible from farther away, so such strips are not preferred.
    """
    saliency = patch_means(compute_saliency(guide), places, size)
    return np.maximum(saliency, np.median(saliency))


def find_least_salient(guide: GuidanceMaps, layout: Layout) -> Int[Array, "2"]:
    """Place of the corner patch: it is repeated at every corner, so it should show no landmark.

    Every place on the coarsest grid is compared; of equal ones the most south-western is taken.
    """
    size = (2 * layout.corner, 2 * layout.corner)
    places = keep_certain(guide, list_places(layout, size), size)
    saliency = compute_saliency(guide) + LANDMARK_COST * guide.landmarks
    return places[np.argmin(patch_means(saliency, places, size))]


def compute_mismatch(
    guide: GuidanceMaps, zone: tuple[Array, Array], shown: tuple[Array, Array], places: Int[Array, "n 2"]
) -> Float[Array, "n"]:
    """Lower bound of a seam's cost against a patch at each place: the least squared feature difference along each of
    many lines that the seam has to cross, averaged over the lines.

    A shrub that fills a line from end to end is expensive, one that the seam can go around is not.
    zone: cells (y, x) of the lines, [line, cell], in the patch's own coordinates. shown: the exemplar's cells (y, x)
    that are visible there before the cut.
    """
    step = max(1, zone[0].size // SAMPLES)
    y, x = (v[::step] for v in zone)
    there = guide.features[shown[0][::step], shown[1][::step]]
    columns = guide.features.shape[1]
    features, cells = guide.features.reshape(-1, there.shape[-1]), y * columns + x

    def cost(shift: int) -> float:
        off = features.take(cells + shift, axis=0) - there
        return float(np.einsum("lck,lck->lc", off, off).min(1).mean())

    return np.array([cost(int(py * columns + px)) for px, py in places])


def find_fitting(cost: Float[Array, "n"]) -> Int[Array, "k"]:
    """Indices of the places that fit about as well as the best; variety is sought among these alone.

    In a texture these are nearly all. Where the exemplar has a road, they are the places at which it is not cut off at
    the tile's border: a repeated centre is less visible than an interrupted road.
    """
    return np.flatnonzero(cost <= FIT_FACTOR * np.quantile(cost, 0.02))


def divide_by_median(cost: Float[Array, "n"]) -> Float[Array, "n"]:
    """Costs in units of their median; unchanged if that is 0."""
    median = np.median(cost)
    return cost / median if median > 0 else cost


def rank_places(
    places: Int[Array, "n 2"],
    cost: Float[Array, "n"],
    size: tuple[int, int],
    used: list[UsedPatch],
    taken: Int[Array, "k 2"],
) -> Int[Array, "n 2"]:
    """Candidate places from best to worst.

    cost: relative. used: patches (place, size) next to this one. taken: places of this patch's siblings; nearly the
    same place again ranks last.
    """
    score = cost.copy()
    for place, other in used:
        score += REPEAT_COST * overlap_share(places, size, place, other)
    for place in taken:
        score += REPEAT_COST * overlap_share(places, size, place, size) / len(taken)
        score += 10 * REPEAT_COST * np.maximum(0, 1 - np.abs(places - place).max(1) / (NEAR_SHARE * min(size)))
    return places[np.argsort(score, kind="stable")]


def rank_pairs(
    places: Int[Array, "n 2"],
    cost: Float[Array, "n"],
    pair_cost: Float[Array, "n n"],
    size: tuple[int, int],
    used: list[UsedPatch],
) -> Int[Array, "p 2 2"]:
    """Pairs of different candidate places from best to worst; of a single candidate, the place twice.

    cost: relative, of each. pair_cost: additional cost of two together, symmetric. used: see `rank_places`. Pairs that
    show nearly the same come last.
    """
    for place, other in used:
        cost = cost + REPEAT_COST * overlap_share(places, size, place, other)
    first, second = np.triu_indices(len(places), len(places) > 1)
    apart = np.abs(places[first] - places[second])
    common = np.maximum(np.subtract(size, apart), 0).prod(1) / np.prod(size)
    score = cost[first] + cost[second] + pair_cost[first, second] + REPEAT_COST * common
    order = np.lexsort((score, apart.max(1) < NEAR_SHARE * min(size)))
    return np.stack([places[first[order]], places[second[order]]], 1)


@dataclass(frozen=True)
class OverlaidPatches:
    """The sum of patches that lie at the same place of their tiles, by which visible repetition is measured.

    All tiles are placed equally often, so a terrain's average over its periods is the mean of the tiles'
    pictures. The variance of that mean, as a share of the ground's own, is the terrain's autocorrelation
    at the distance of one tile: a visible lattice. Lines along a row or a column of tiles, such as a bare
    strip, are the worst: they continue through the whole terrain.

    Attributes:
        ground: the exemplar's colours, blurred to a sample's width, of mean 0 and variance 1 over all its cells.
        sample: cells between two samples.
        side: samples along a tile.
        margin: cells (x, y) of a patch that are left out at each side.
        total: sum of the patches so far.
        cover: colours that lie over any of these patches, NaN where the patch is visible; None: nothing does.
    """

    ground: Float[Array, "m m c"]
    sample: int
    side: int
    margin: tuple[int, int]
    total: Float[Array, "h w c"]
    cover: Float[Array, "h w c"] | None = None

    def crop(self, place: Int[Array, "2"]) -> Float[Array, "h w c"]:
        """The samples of a patch at a place (x, y)."""
        x, y = np.add(place, self.margin)
        h, w = self.total.shape[:2]
        s = self.sample
        patch = self.ground[y : y + h * s : s, x : x + w * s : s]
        return patch if self.cover is None else np.where(np.isnan(self.cover), patch, self.cover)

    def crop_all(self, places: Int[Array, "n 2"]) -> Float[Array, "n h w c"]:
        """The same at each place."""
        return np.stack([self.crop(place) for place in places])

    def compute_costs(self, crops: Float[Array, "n h w c"]) -> Float[Array, "n"]:
        """Added repetition, per sample, of each patch.

        sum |total + B|^2 - |total|^2 - |B|^2 = 2 sum total B: a patch's own square is left out, or tiles would be
        plainer than the ground. The squares of the means over a tile's rows and columns, LINE_WEIGHT times, are charged
        in full: a line continues in the next tile.
        """
        across, along = self.total.sum(1) / self.side, self.total.sum(0) / self.side

        rows, columns = crops.sum(2) / self.side, crops.sum(1) / self.side
        lines = ((2 * across + rows) * rows).sum((1, 2)) + ((2 * along + columns) * columns).sum((1, 2))
        products = np.einsum("nhwc,hwc->n", crops, self.total)  # no BLAS, whose sums may depend on its threads
        return (2 * products + LINE_WEIGHT * self.side * lines) / (self.total.size / self.total.shape[-1])

    def compute_pair_costs(self, places: Int[Array, "n 2"]) -> Float[Array, "n n"]:
        """Repetition of patches at each two places together, without any other: 2 sum B B' and the lines of B + B'.

        Two patches chosen as a pair complement one another; chosen one after the other, the second takes what is left.
        """
        crops = self.crop_all(places)
        along, across = (crops.sum(axis) / self.side for axis in (1, 2))
        lines = _square_sums(along) + _square_sums(across)
        flat = crops.reshape(len(places), -1)
        return (2 * flat @ flat.T + LINE_WEIGHT * self.side * lines) / (flat.shape[1] / crops.shape[-1])

    def with_patch(self, place: Int[Array, "2"]) -> "OverlaidPatches":
        """The overlay with one more patch, at that place."""
        return replace(self, total=self.total + self.crop(place))


def _square_sums(pictures: Float[Array, "n k c"]) -> Float[Array, "n n"]:
    """Squared norm of the sum of each two pictures."""
    flat = pictures.reshape(len(pictures), -1)
    products = flat @ flat.T
    own = np.diag(products)
    return own[:, None] + own[None] + 2 * products


def start_overlay(
    colour: Float[Array, "m m c"],
    side: int,
    size: tuple[int, int],
    margin: tuple[int, int] = (0, 0),
    cover: tuple[Bool[Array, "h w"], tuple[Array, Array]] | None = None,
) -> OverlaidPatches:
    """An overlay without any patch yet, for patches of a size (width, height) with a hidden margin at each side.

    side: the tile's, in cells. cover: where something lies over the patches, and the exemplar's cells (rows, columns)
    that are visible there; only for patches without a margin.
    """
    sample = max(1, side // OVERLAY_SAMPLES)
    soft = np.stack([gaussian_filter(colour[..., c], sample, mode="nearest") for c in range(colour.shape[-1])], -1)
    soft -= soft.mean((0, 1))
    spread = float(np.sqrt((soft**2).sum(-1).mean()))
    w, h = (max(1, (whole - 2 * left) // sample) for whole, left in zip(size, margin, strict=True))
    ground, total = soft / safe_unit(spread), np.zeros((h, w, colour.shape[-1]))
    cover_colours = None
    if cover:
        over, rows, columns = (v[::sample, ::sample][:h, :w] for v in (cover[0], *cover[1]))
        cover_colours = np.where(over[..., None], ground[rows, columns], np.nan)
    return OverlaidPatches(ground, sample, max(1, side // sample), margin, total, cover_colours)
