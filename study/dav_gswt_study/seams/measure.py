"""One cell of the table of seams: crops of a tile set on level and on hilly ground, from near, walking and from above.

place: `border`; `cut`; `ceiling`, for each cut the nearest one of tiles with straight, unsearched seams; `floor`, for
each crop its patches alone, each weighted where the crop shows it (`perceptual_distance.compute_floor`).
psnr: of the crop against a composite in which each pixel shows its own patch alone: gaps, double layers and visible
borders lower it. jump: RMS colour difference of neighbouring pixels across the seam over that inside the patches; 1 is
no jump.
"""

import logging
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float, Float32, Int, UInt8
from numpy import ndarray as Array

from dav_gswt.errors import InputError
from dav_gswt.images import metrics
from dav_gswt.images.lpips_weights import Weights
from dav_gswt.lod.store import Levels
from dav_gswt.logs import progress
from dav_gswt.terrain import heights
from dav_gswt.terrain.endless import EndlessTerrain
from dav_gswt.tiles import energy, layout
from dav_gswt.tiles.build import TileSet
from dav_gswt.tiles.semantics import SemanticSource
from dav_gswt_study.seams import crops, perceptual_distance, places
from dav_gswt_study.seams.crops import Crop, RenderedCrop, View
from dav_gswt_study.seams.placed_tiles import DetrendedExemplar, ExemplarMaps, PlacedTiles
from dav_gswt_study.seams.places import Place

_log = logging.getLogger(__name__)

BORDERS, CUTS = 64, 64  # crops of each, view and ground
MAX_BORDER_PLACES = 12 * BORDERS  # places that are searched for crops without a cut
BANK_SIZE = 160  # crops of the exemplar in a view
COLUMNS = ("place", "view", "ground", "crop", "cluster", "seam_lpips", "psnr", "jump")
MAX_PSNR = 80.0  # dB, of pictures that are equal but for rounding
STRONG = 0.75  # quantile of the exemplar's gradients above which they are strong; 1/4 of random seams is
GROUNDS = {"flat": {"kind": "flat"}, "hilly": {"kind": "hills", "height": 3.0, "wavelength": 20.0}}


@dataclass(frozen=True)
class SampledCrop:
    """A rendered crop with its kind of place, its number, and the part of the seam that it shows."""

    place: str
    number: int
    cluster: str
    shown: RenderedCrop


@dataclass(frozen=True)
class CropBank:
    """Vectors of crops of the exemplar, and the cells of the exemplar that each shows."""

    vectors: Float32[Array, "m d"]
    boxes: Int[Array, "m 2 2"]


def measure_materials(
    sets: Iterable[tuple[Levels, TileSet]], tiling: dict, weights: Weights | None, seed: int, tau: float
) -> tuple[list[dict], float]:
    """The rows of `measure_crops` of all materials' tile sets, each beside its own exemplar, and their mean density."""
    rows, dense = [], []
    for number, (levels, tiles) in enumerate(sets):
        maps = ExemplarMaps.from_levels(levels)
        placed, straight = maps.place_with_straight(tiles, tiling, SemanticSource(weights), seed, tau, number)
        rows += _number_material(measure_crops(placed, straight, weights, seed), number)
        dense.append(seam_density(tiles, placed.source))
    return rows, float(np.mean(dense))


def _number_material(rows: list[dict], material: int) -> list[dict]:
    """The rows with numbers of crops and names of clusters that no other material has."""
    if not material:
        return rows
    first = material * (BORDERS + 2 * CUTS)
    return [row | {"crop": row["crop"] + first, "cluster": f"m{material}:{row['cluster']}"} for row in rows]


def measure_crops(placed: PlacedTiles, straight: PlacedTiles, weights: Weights | None, seed: int) -> list[dict]:
    """Rows of all crops: place, view, ground, crop, cluster, seam_lpips, psnr, jump; without weights no seam_lpips.

    straight: tiles of the same exemplar and size with straight, unsearched seams.
    Raises: InputError: fewer than half of the crops of a kind of place can be rendered.
    """
    if weights is None:
        _log.warning("crops are compared without LPIPS (config: lpips: none)")
    rows = []
    views = [(ground, view) for ground in GROUNDS for view in crops.VIEWS]
    for ground, view in progress(views, "measure seams"):
        surface = heights.surface_from_config(GROUNDS[ground], placed.terrain.side, 1.0)
        draped, beside = (replace(sample.terrain, heights=surface) for sample in (placed, straight))
        rng = np.random.default_rng([seed, 7])
        samples = [
            *_sample_borders(placed, draped, view, rng),
            *_sample_cuts(placed, draped, (straight, beside), view, rng),
        ]
        values = [(None, None)] * len(samples)
        if weights:
            all_crops = [sample.shown.crop for sample in samples]
            bank = sample_exemplar_bank(placed, draped, all_crops, weights, rng)
            values = compute_seam_lpips(samples, bank, weights)
        for sample, (value, floor) in zip(samples, values, strict=True):
            rows += [
                {key: row[key] for key in COLUMNS} for row in _tabulate_crop(sample, view.name, ground, value, floor)
            ]
    return rows


def _sample_borders(placed: PlacedTiles, terrain: EndlessTerrain, view: View, rng) -> list[SampledCrop]:
    """Crops that show a border alone, and if these are too few, some with a cut as well."""
    samples = []
    for place, crop, patches in _find_borders(placed, terrain, view, rng):
        shown = crops.render_patches(placed, terrain, crop, patches, border=True)
        if shown.shows_patch:
            samples.append(SampledCrop("border", len(samples), place.cluster, shown))
        if len(samples) == BORDERS:
            return samples
    return _require_enough(samples, BORDERS, "borders")


def _find_borders(
    placed: PlacedTiles, terrain: EndlessTerrain, view: View, rng
) -> Iterator[tuple[Place, Crop, list[int]]]:
    """Crops on borders and their patches: those of one patch, as they are found, then those with a cut as well."""
    others = []
    for place in places.sample_borders(placed, rng)[:MAX_BORDER_PLACES]:
        if (crop := crops.make_crop(placed, terrain, view, place.at)) and (patches := crops.find_patches(placed, crop)):
            if len(patches) > 1:
                others.append((place, crop, patches))
            else:
                yield place, crop, patches
    yield from others


def _sample_cuts(
    placed: PlacedTiles, terrain: EndlessTerrain, straight: tuple[PlacedTiles, EndlessTerrain], view: View, rng
) -> list[SampledCrop]:
    """Crops of cuts, each followed by its ceiling."""
    samples = []
    for place in places.sample_cuts(placed, rng):
        beside = places.find_nearest_cut(straight[0], place)
        cut = crops.find_cut(placed, terrain, view, place.at) if beside else None
        ceiling = crops.find_cut(*straight, view, beside.at) if beside else None
        if cut and ceiling:
            number = BORDERS + len(samples) // 2  # of the cut; its ceiling's is CUTS more
            shown = crops.render_patches(placed, terrain, *cut), crops.render_patches(*straight, *ceiling)
            if shown[0].shows_patch and shown[1].shows_patch:
                samples.append(SampledCrop("cut", number, place.cluster, shown[0]))
                samples.append(SampledCrop("ceiling", number + CUTS, place.cluster, shown[1]))
        if len(samples) == 2 * CUTS:
            return samples
    return _require_enough(samples, 2 * CUTS, "cuts")


def _require_enough(samples: list[SampledCrop], wanted: int, what: str) -> list[SampledCrop]:
    if len(samples) < wanted // 2:
        raise InputError(
            f"seams: only {len(samples)} of {wanted} crops of the tiles' {what} could be rendered: patches do not "
            "meet, or end inside a crop; use a finer preset, or another `tile` and `strip` in the config's tilings"
        )
    return samples


def compute_seam_lpips(samples: list[SampledCrop], bank: CropBank, weights: Weights) -> Iterator[tuple[float, float]]:
    """Seam-LPIPS of every crop and its floor. bank: of the same view and ground."""
    pictures = [np.stack([sample.shown.picture, *sample.shown.own]) for sample in samples]
    vectors, shapes = perceptual_distance.embed_images(np.concatenate(pictures), weights)
    difference = perceptual_distance.pairwise_distances(vectors, bank.vectors)
    ends = np.cumsum([len(some) for some in pictures])[:-1]
    for sample, mine, far in zip(samples, np.split(vectors, ends), np.split(difference, ends), strict=True):
        near = perceptual_distance.find_nearest(
            far, perceptual_distance.exclude_overlaps(sample.shown.sources, bank.boxes)
        )
        nearest = [bank.vectors[chosen] for chosen in near[1:]]
        yield (
            float(far[0, near[0]].mean()),
            perceptual_distance.compute_floor(
                mine[1:], nearest, perceptual_distance.pool_masks(sample.shown.masks, shapes)
            ),
        )


def sample_exemplar_bank(
    placed: PlacedTiles, terrain: EndlessTerrain, all_crops: list[Crop], weights: Weights, rng: np.random.Generator
) -> CropBank:
    """BANK_SIZE random crops of the exemplar, each in the place of one of the crops in turn, so that slopes match."""
    pictures, boxes = [], []
    for k in range(BANK_SIZE):
        crop = all_crops[k % len(all_crops)]
        low, high = -crop.box[0], placed.source.exemplar.cells - 1 - crop.box[1]  # bounds of the origin
        origin = -rng.integers(low, high + 1)
        pictures.append(crops.render_patch(placed, terrain, crop, origin, np.zeros(4)))
        boxes.append(crop.box - origin)
    return CropBank(perceptual_distance.embed_images(np.stack(pictures), weights)[0], np.stack(boxes))


def _tabulate_crop(
    sample: SampledCrop, view: str, ground: str, value: float | None, floor: float | None
) -> Iterator[dict]:
    """The row of a crop and that of its floor."""
    shown, about = sample.shown, {"view": view, "ground": ground, "crop": sample.number, "cluster": sample.cluster}
    side = shown.tile if sample.place == "border" else shown.patch
    known = shown.patch >= 0
    composite = np.take_along_axis(shown.own, np.maximum(shown.patch, 0)[None, ..., None], 0)[0]
    psnr = metrics.psnr(shown.picture, composite, known.astype(float))
    row = {"place": sample.place} | about | {"seam_lpips": value, "psnr": min(psnr or MAX_PSNR, MAX_PSNR)}
    yield row | {"jump": measure_jump(shown.picture, side, known)}
    jumps = [measure_jump(picture, side, known) for picture in shown.own]
    known_jumps = [jump for jump in jumps if jump is not None]
    mean = float(np.dot(known_jumps, shown.share)) if len(known_jumps) == len(jumps) else None
    yield {"place": "floor"} | about | {"seam_lpips": floor, "psnr": None, "jump": mean}


def measure_jump(picture: Float[Array, "h w 3"], side: Int[Array, "h w"], known: Bool[Array, "h w"]) -> float | None:
    """RMS colour difference of neighbours across the seam over that of neighbours on one side; None without pairs."""
    across, within = [], []
    for axis in (0, 1):
        colour, which, counted = (np.swapaxes(v, 0, axis) for v in (picture, side, known))
        counts = counted[1:] & counted[:-1]
        difference = ((colour[1:] - colour[:-1]).astype(float) ** 2).sum(-1)
        other = which[1:] != which[:-1]
        across.append(difference[counts & other])
        within.append(difference[counts & ~other])
    over, inside = (np.concatenate(pair) for pair in (across, within))
    if not (len(over) and len(inside) and inside.mean() > 0):
        return None
    return float(np.sqrt(over.mean() / inside.mean()))


def seam_density(tiles: TileSet, source: DetrendedExemplar) -> float:
    """Share of all cuts' edges between cells where either patch's gradient is among the exemplar's strongest quarter,
    counted by patch. Source: DAV-GSWT speaks of "seam density around object boundaries" without a formula.
    """
    colour = source.ground[..., :3]
    steep = np.linalg.norm(energy.compute_gradients(np.nan_to_num(colour, nan=float(np.nanmean(colour)))), axis=-1)
    strong = steep > np.quantile(steep, STRONG)
    parts = [_edge_steepness(strong, tiles.labels[t], tiles.shifts[t]) for t in range(len(tiles.labels))]
    edges = np.concatenate(parts)
    return float(edges.mean()) if len(edges) else 0.0


def _edge_steepness(strong: Bool[Array, "m m"], labels: UInt8[Array, "n n"], shift: Array) -> Float[Array, "edges"]:
    """For each end of each edge that is cut, whether what is shown there is steep."""
    rows, columns = layout.source_cells(labels, shift)
    here, values = strong[rows, columns].astype(float), []
    for axis in (0, 1):
        labels, here = (np.swapaxes(v, 0, axis) for v in (labels, here))
        cut = labels[1:] != labels[:-1]
        values += [here[:-1][cut], here[1:][cut]]
    return np.concatenate(values)
