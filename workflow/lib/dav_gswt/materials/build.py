"""The materials of a field: their exemplars, the objects on them, and a verdict."""

import logging
import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from jaxtyping import Bool, Float
from numpy import ndarray as Array
from scipy.ndimage import distance_transform_edt

from dav_gswt.field import GaussianField
from dav_gswt.logs import progress
from dav_gswt.materials import extraction, outlines, segmentation
from dav_gswt.materials.borders import measure_bend, measure_fray
from dav_gswt.materials.classes import GroundClasses, classify_ground
from dav_gswt.materials.filling import fill_cells
from dav_gswt.materials.maps import GroundMaps, measure_ground, read_masks
from dav_gswt.materials.model import MaterialInfo
from dav_gswt.reconstruction.ground import Ground
from dav_gswt.tiles import energy, layout, patches, texture

_log = logging.getLogger(__name__)

WINDOWS = (1.0, 0.9, 0.8, 0.7, 0.6)  # sides of a material's exemplar over the whole one's
OWN_SHARE = 0.8  # of its exemplar that a material fills itself, if a smaller window can do that
BLOCK = 32  # cells: exemplars are whole numbers of it, as far as the whole one is
AREAS = 2.0  # tile areas that the scarcest material has at least, if tiles are made smaller for it
SMALLEST_TILE = 0.22  # of the exemplar's side
LEAST_AREAS = 0.5  # smallest tiles' areas of a material, of which less was photographed: it is left out
ROOM = 1.6  # sides of a tile that an exemplar is wide at least
PATCH, SMALLEST_PATCH = 3.0, 8  # side of a filling patch, in scales of the texture and in cells, at least
GOOD, MARGINAL = 4.0, 2.0  # tile areas of a material that were photographed
ROUNDING = 1e-6  # of areas: tiles are made so large that the scarcest material has MARGINAL of them


@dataclass(frozen=True)
class MaterialVerdict:
    """Whether there is enough of a material: good, marginal or no; and the reason as a sentence for people."""

    grade: str
    reason: str


@dataclass(frozen=True)
class Material:
    """A material: what it is, its exemplar (a field whose grid has no margin), and whether there is enough of it.

    filled: share of the exemplar's cells that show copies of others.
    """

    info: MaterialInfo
    field: GaussianField
    grid: Ground
    filled: float
    verdict: MaterialVerdict


@dataclass(frozen=True)
class ExtractedObject:
    """An object around its foot. radius, height: in world units; density: of such objects on its material."""

    name: str
    field: GaussianField
    material: int
    radius: float
    height: float
    density: float


@dataclass(frozen=True)
class FoundMaterials:
    """All materials of an exemplar, the largest first, and the objects on them.

    tile_side: of tiles of these materials, in cells: by the texture of the largest one, smaller where there is little
    of a material; None: as without materials.
    """

    maps: GroundMaps
    classes: GroundClasses
    tile_side: float | None
    materials: list[Material]
    objects: list[ExtractedObject]
    verdict: MaterialVerdict


@dataclass(frozen=True)
class _Parts:
    """What all steps read. features: weighed CIELAB of all cells."""

    field: GaussianField
    grid: Ground
    maps: GroundMaps
    features: Float[Array, "m m k"]
    classes: GroundClasses
    tile_side: float
    seed: int


def find_materials(
    field: GaussianField,
    grid: Ground,
    seed: int,
    mask_files: Mapping[str, Path | str] | None = None,
) -> FoundMaterials:
    """Find the materials of a field's exemplar and the objects on them.

    Ground of one material without objects is given back as it is. So are, with a warning, ground of
    which nothing would be left to tile, and a field without a ground layer (an imported field, or ground
    that is too rough for a layer).

    Args:
        mask_files: by material, or `exclude`; see `maps.read_masks`.
    """
    maps = measure_ground(field, grid)
    if not field.ground.any():
        _log.warning("materials: this field has no ground layer: all of the ground is tiled as one")
        return _keep_whole(field, grid, maps)
    masks = read_masks(mask_files, maps.cells) if mask_files else None
    classes = classify_ground(maps, masks)
    free = replace(maps, known=maps.known & ~classes.excluded)
    refined = replace(classes, footprints=outlines.refine_footprints(free, classes.footprints))
    # what stood out beside the closer outlines is shown nowhere
    classes = replace(refined, excluded=classes.excluded | (classes.occupied & ~refined.occupied))
    sources = [_ignore_scarce(classes, k) for k in range(classes.number)]
    if all(source.all() for source in sources) and masks is None:
        return _keep_whole(field, grid, maps)
    features = segmentation.describe_cells(maps.colour)[..., :3]
    parts = _Parts(field, grid, maps, features, classes, choose_tile_side(maps, sources), seed)
    made = {k: _make_material(parts, k, sources[k]) for k in progress(range(classes.number), "fill materials")}
    kept = {k: each for k, each in made.items() if each is not None}
    if not kept:
        _log.warning(
            "materials: nothing is left to tile (shade, objects or cut off): all of the ground is tiled as one"
        )
        return _keep_whole(field, grid, maps)
    total = sum(each.info.share for each in kept.values())
    materials = [replace(each, info=replace(each.info, share=each.info.share / total)) for each in kept.values()]
    objects = _extract_objects(parts, {k: place for place, k in enumerate(kept)})
    return _report(maps, classes, parts.tile_side, materials, objects)


def _keep_whole(field: GaussianField, grid: Ground, maps: GroundMaps) -> FoundMaterials:
    """All of the ground as one material."""
    everything, nothing = np.ones(maps.known.shape, bool), np.zeros(maps.known.shape, bool)
    side = choose_tile_side(maps, [everything])
    colour = [float(value) for value in maps.colour.mean((0, 1))]
    info = MaterialInfo("material0", 1.0, maps.cells * grid.spacing, colour, None, None)
    judged = judge_material(info.name, (maps.cells / side) ** 2, 0.0)
    classes = GroundClasses(nothing.astype(int), nothing.astype(int), [], nothing, [info.name])
    return _report(maps, classes, None, [Material(info, field, grid, 0.0, judged)], [])


def _report(
    maps: GroundMaps,
    classes: GroundClasses,
    tile_side: float | None,
    materials: list[Material],
    objects: list[ExtractedObject],
) -> FoundMaterials:
    """What was found, with a verdict on all of it, which is logged."""
    verdicts = {each.info.name: each.verdict for each in materials}
    shares = {each.info.name: each.info.share for each in materials}
    judged = judge_set(verdicts, shares, float(classes.excluded.mean()))
    for name, each in verdicts.items():
        _log.info("%s: %s: %s", name, each.grade, each.reason)
    _log.info("%d objects; %s: %s", len(objects), judged.grade, judged.reason)
    return FoundMaterials(maps, classes, tile_side, materials, objects, judged)


def choose_tile_side(maps: GroundMaps, sources: list[Bool[Array, "m m"]]) -> float:
    """Side of a tile in cells: by the texture of the first material, smaller if a material has no AREAS of it.

    It is at least SMALLEST_TILE of the exemplar's side. A material that has no AREAS even of such tiles
    is ignored: it would make the tiles of the others small for nothing.
    """
    first = sources[0] if sources[0].any() else np.ones_like(sources[0])
    by_texture, _ = texture.choose_sizes(texture.measure_texture_scale(_blur_others(maps, first)) / maps.cells)
    shares = [float(source.mean()) for source in sources]
    by_area = min([1.0, *(np.sqrt(share / AREAS) for share in shares if share >= AREAS * SMALLEST_TILE**2)])
    return float(max(SMALLEST_TILE, min(by_texture, by_area))) * maps.cells


def _ignore_scarce(classes: GroundClasses, number: int) -> Bool[Array, "m m"]:
    """The cells that a material is made of; none, with a warning, where they are too few for any tile."""
    own = classes.source(number)
    if own.mean() >= LEAST_AREAS * SMALLEST_TILE**2:
        return own
    left = f"{own.mean():.1%} of the ground is left of {classes.names[number]} without shade, objects and the like"
    _log.warning("%s, too little for a tile: it is left out", left)
    return np.zeros_like(own)


def _make_material(parts: _Parts, number: int, own: Bool[Array, "m m"]) -> Material | None:
    """The exemplar of one material, made of its own cells; None where it has no room for a patch."""
    grid = parts.grid
    if not own.any():
        return None
    row, column, cells = choose_window(own, parts.tile_side)
    window, source = parts.maps.crop(row, column, cells), own[row : row + cells, column : column + cells]
    hidden = energy.make_occluder_layer(window.cover)
    terms = energy.SeamEnergy("colour", 0.0, energy.make_colour_layer(window.colour), None, hidden).terms(1.0)
    plan = layout.plan_layout(cells, 1, min(1.0, parts.tile_side / cells), 0.125)
    features = patches.make_guidance(window.colour, window.height, np.zeros(source.shape), plan).features
    rng = np.random.default_rng([parts.seed, number])
    sources = fill_cells(features, terms, source, _choose_patch(window, source), rng)
    if sources is None:
        _log.warning("%s is too small and narrow to be tiled; it is left out", parts.classes.names[number])
        return None
    small = replace(grid, first_row=grid.first_row + row, first_column=grid.first_column + column, cells=cells)
    made, made_grid = extraction.extract_exemplar(parts.field, small, window, sources, source)
    filled = float(sources.copied.mean())
    colour = [float(value) for value in parts.maps.colour[own].mean(0)]
    share = float(parts.classes.shares[number])
    counted = parts.maps.known & ~parts.classes.excluded & ~parts.classes.occupied
    whole = parts.classes.materials == number  # with the excluded ground in it: shade of a tree parts no material
    patch_scale = _measure_patches(whole) * grid.spacing
    fray = measure_fray(parts.features, whole, counted, parts.tile_side)
    bend = measure_bend(whole, counted, parts.tile_side)
    fray, bend = (None if value is None else value * grid.spacing for value in (fray, bend))
    info = MaterialInfo(parts.classes.names[number], share, patch_scale, colour, fray, bend)
    judged = judge_material(info.name, float(own.sum()) / parts.tile_side**2, filled)
    return Material(info, made, made_grid, filled, judged)


def choose_window(own: Bool[Array, "m m"], tile_side: float) -> tuple[int, int, int]:
    """South-western cell (row, column) and side of the square that a material's exemplar is made of.

    It is the largest square that the material fills by OWN_SHARE, or else the smallest one. Patches of a
    tile's side have places to choose from in it.
    """
    m = len(own)
    unit = int(np.gcd(m, BLOCK))
    least = min(m, ROOM * tile_side)
    sides = sorted({min(m, -(-int(max(share * m, least)) // unit) * unit) for share in WINDOWS}, reverse=True)
    for side in sides:
        counts = patches.box_sums(own, side, side)
        if counts.max() >= OWN_SHARE * side * side or side == sides[-1]:
            row, column = np.unravel_index(int(counts.argmax()), counts.shape)
            return int(row), int(column), side
    raise AssertionError("the last side is always taken")


def _choose_patch(maps: GroundMaps, source: Bool[Array, "m m"]) -> int:
    """Side of a patch in cells: some scales of the texture, and not too wide for the source."""
    width = 2 * float(distance_transform_edt(np.pad(source, 1)).max())
    scale = texture.measure_texture_scale(_blur_others(maps, source))
    return int(np.clip(round(PATCH * scale), SMALLEST_PATCH, max(SMALLEST_PATCH, width / 3)))


def _blur_others(maps: GroundMaps, source: Bool[Array, "m m"]) -> Float[Array, "m m 3"]:
    """The colours of a source; cells of other ground have its blurred colour."""
    blur = texture.TREND * len(source)
    soft = [extraction.blur_over(layer, source, blur) for layer in np.moveaxis(maps.colour, -1, 0)]
    return np.where(source[..., None], maps.colour, np.dstack(soft))


def _measure_patches(own: Bool[Array, "m m"]) -> float:
    """Mean length in cells of what lines along rows and columns cross in one piece.

    Each piece has two ends; those that the exemplar's border cuts off are not counted, as the piece goes on there.
    """
    ends = sum(int(np.diff(own, axis=axis).sum()) for axis in (0, 1))
    return 4 * float(own.sum()) / max(ends, 1)


def _extract_objects(parts: _Parts, index: dict[int, int]) -> list[ExtractedObject]:
    """All objects; index: new number of each material that is kept. Others' objects stand on the largest one."""
    spacing, objects = parts.grid.spacing, []
    areas = parts.classes.shares * float((~parts.classes.excluded).sum()) * spacing**2
    standing = extraction.bin_standing(parts.field, parts.grid, parts.maps)
    for number, footprint in enumerate(parts.classes.footprints):
        own = extraction.extract_object(parts.field, parts.grid, parts.maps, standing, footprint)
        radius = float(np.sqrt(footprint.cells.sum() / np.pi)) * spacing
        ground = footprint.material if footprint.material in index else next(iter(index))  # that it is placed on
        height, density = float(own.means[:, 2].max()), 1 / float(areas[ground])
        material = index[ground]
        objects.append(ExtractedObject(f"object{number:02d}", own, material, radius, height, density))
    return objects


def judge_material(name: str, areas: float, filled: float) -> MaterialVerdict:
    """The verdict on a material by the number of tile areas of it that were photographed.

    filled: share of its exemplar that is made of patches.
    """
    areas *= 1 + ROUNDING
    tenth = round(areas, 1)  # but never up to a bound that is not reached
    tenth -= 0.1 * any(areas < bound <= tenth for bound in (GOOD, MARGINAL))
    seen = f"{name} was photographed on {tenth:.1f} tile areas"
    if areas >= GOOD:
        return MaterialVerdict("good", seen)
    times = math.ceil(10 * GOOD / max(areas, 0.1)) / 10  # up, for "1.0 times" asks for nothing
    more = f"photograph {times:.1f} times as much of it"
    if areas >= MARGINAL:
        return MaterialVerdict("marginal", f"{seen}: repeats may be seen; {more}")
    made = f", and {filled:.0%} of what its tiles are cut from is made of patches" if filled > 0.05 else ""
    return MaterialVerdict("no", f"{seen}{made}: repeats will be seen; {more}, or leave it out")


def judge_set(verdicts: dict[str, MaterialVerdict], shares: dict[str, float], excluded: float) -> MaterialVerdict:
    """The verdict on all: that on the material that covers most. Materials of which there is too little are named.

    Args:
        verdicts, shares: by the materials' names.
        excluded: share of ground that is shown nowhere, paths and roads among it.
    """
    grade = verdicts[max(shares, key=lambda name: shares[name])].grade
    if excluded > 0.5 and grade == "good":
        reason = f"{excluded:.0%} of the ground is shade, rare or cut off, and shown nowhere"
        return MaterialVerdict("marginal", reason)
    many = "1 material" if len(verdicts) == 1 else f"{len(verdicts)} materials"
    scarce = [name for name, verdict in verdicts.items() if verdict.grade == "no"]
    lacking = f"; of {' and '.join(scarce)} there is too little" if scarce else ""
    return MaterialVerdict(grade, f"{many}, {excluded:.0%} of the ground is shown nowhere{lacking}")
