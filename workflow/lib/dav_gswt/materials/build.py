"""The materials of a field: their exemplars, the objects on them, and a verdict."""

import logging
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

import numpy as np
from jaxtyping import Bool, Float
from numpy import ndarray as Array
from scipy.ndimage import distance_transform_edt

from dav_gswt.field import GaussianField
from dav_gswt.logs import progress
from dav_gswt.materials import extraction, mask_images, outlines, segmentation, verdict
from dav_gswt.materials.borders import measure_bend, measure_fray
from dav_gswt.materials.classes import GroundClasses, classify_ground
from dav_gswt.materials.filling import CellSources, box_sums, fill_cells
from dav_gswt.materials.maps import GroundMaps, measure_ground
from dav_gswt.materials.mobilesam import Segmenter
from dav_gswt.materials.model import MaterialInfo
from dav_gswt.materials.verdict import MaterialVerdict
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


@dataclass(frozen=True)
class Material:
    """A material: what it is, its exemplar (a field whose grid has no margin), and whether there is enough of it.

    filled: share of the exemplar's cells that show copies of others. pattern: see `texture.measure_pattern`.
    """

    info: MaterialInfo
    field: GaussianField
    grid: Ground
    filled: float
    verdict: MaterialVerdict
    pattern: float | None = None


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
    """What all steps read."""

    field: GaussianField
    grid: Ground
    maps: GroundMaps
    classes: GroundClasses
    tile_side: float
    seed: int

    @cached_property
    def features(self) -> Float[Array, "m m k"]:
        """Weighed CIELAB of all cells."""
        return segmentation.describe_cells(self.maps.colour)[..., :3]


def find_materials(
    field: GaussianField,
    grid: Ground,
    seed: int,
    mask_files: Mapping[str, Path | str] | None = None,
    segmenter: Segmenter | None = None,
) -> FoundMaterials:
    """Find the materials of a field's exemplar and the objects on them.

    mask_files: by material, or `exclude`; see `mask_images`. segmenter: of the outlines of objects; None: they are cut
    by colour and height.

    Ground of one material without objects is given back as it is. So are, with a warning, ground of which nothing would
    be left to tile, and a field without a ground layer (one that was imported, or of ground too rough for a layer).
    """
    maps = measure_ground(field, grid)
    if not field.ground.any():
        _log.warning("materials: this field has no ground layer: all of the ground is tiled as one")
        return _keep_whole(field, grid, maps)
    masks = mask_images.read_masks(mask_files, maps.cells) if mask_files else None
    classes = _refine_objects(maps, classify_ground(maps, masks), segmenter)
    sources = [_ignore_scarce(classes, k) for k in range(classes.number)]
    if all(source.all() for source in sources) and masks is None:
        return _keep_whole(field, grid, maps)
    parts = _Parts(field, grid, maps, classes, choose_tile_side(maps, sources), seed)
    made = {k: _make_material(parts, k, sources[k]) for k in progress(range(classes.number), "fill materials")}
    kept = {k: each for k, each in made.items() if each is not None}
    if not kept:
        _log.warning(
            "materials: nothing is left to tile (shade, objects or cut off): all of the ground is tiled as one"
        )
        return _keep_whole(field, grid, maps)
    materials = _rescale_shares(list(kept.values()))
    objects = _extract_objects(parts, {k: place for place, k in enumerate(kept)})
    strips = int(classes.kinds.max()) + 1 - classes.number
    verdicts = {each.info.name: each.verdict for each in materials}
    shares = {each.info.name: each.info.share for each in materials}
    patterned = [each.info.name for each in materials if each.pattern]
    judged = verdict.judge_set(verdicts, shares, float(classes.excluded.mean()), max(strips, 0), patterned)
    return _report(FoundMaterials(maps, classes, parts.tile_side, materials, objects, judged))


def _refine_objects(maps: GroundMaps, classes: GroundClasses, segmenter: Segmenter | None) -> GroundClasses:
    """Closer outlines of objects, off excluded ground. What stood out beside them is excluded too."""
    free = replace(maps, known=maps.known & ~classes.excluded)
    refined = replace(classes, footprints=outlines.refine_footprints(free, classes.footprints, segmenter))
    return replace(refined, excluded=classes.excluded | (classes.occupied & ~refined.occupied))


def _keep_whole(field: GaussianField, grid: Ground, maps: GroundMaps) -> FoundMaterials:
    """All of the ground as one material."""
    everything, nothing = np.ones(maps.known.shape, bool), np.zeros(maps.known.shape, bool)
    side = choose_tile_side(maps, [everything])
    colour = [float(value) for value in maps.colour.mean((0, 1))]
    info = MaterialInfo("material0", 1.0, maps.cells * grid.spacing, colour, None, None)
    pattern = texture.measure_pattern(maps.colour)
    judged = verdict.judge_material(info.name, (maps.cells / side) ** 2, 0.0, pattern)
    classes = GroundClasses(
        np.zeros(maps.known.shape, int), np.zeros(maps.known.shape, int), [], nothing, ["material0"]
    )
    material = Material(info, field, grid, 0.0, judged, pattern)
    judged_set = verdict.judge_set({info.name: judged}, {info.name: 1.0}, 0.0, 0, [info.name] if pattern else [])
    return _report(FoundMaterials(maps, classes, None, [material], [], judged_set))


def _report(found: FoundMaterials) -> FoundMaterials:
    for each in found.materials:
        _log.info("%s: %s: %s", each.info.name, each.verdict.grade, each.verdict.reason)
    _log.info("%d objects; %s: %s", len(found.objects), found.verdict.grade, found.verdict.reason)
    return found


def choose_tile_side(maps: GroundMaps, sources: list[Bool[Array, "m m"]]) -> float:
    """Side of a tile in cells: by the texture of the first material; the area of the scarcest holds AREAS tiles of it.

    At least SMALLEST_TILE of the exemplar's side. A material too scarce for AREAS even of these has no say: it would
    make the others' tiles small for nothing.
    """
    first = sources[0] if sources[0].any() else np.ones_like(sources[0])
    by_texture, _ = texture.choose_sizes(_texture_scale(maps, first) / maps.cells)
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
    sources = _fill_window(window, source, parts.tile_side, np.random.default_rng([parts.seed, number]))
    if sources is None:
        _log.warning("%s is too small and narrow to be tiled; it is left out", parts.classes.names[number])
        return None
    small = replace(grid, first_row=grid.first_row + row, first_column=grid.first_column + column, cells=cells)
    made, made_grid = extraction.extract_exemplar(parts.field, small, window, sources, source)
    filled = float(sources.copied.mean())
    # with the excluded ground beside it: shade of a tree parts no material
    patch_scale = _measure_patches(parts.classes.materials == number) * grid.spacing
    colour = [float(value) for value in parts.maps.colour[own].mean(0)]
    share, (fray, bend) = float(parts.classes.shares[number]), _measure_borders(parts, number)
    info = MaterialInfo(parts.classes.names[number], share, patch_scale, colour, fray, bend)
    pattern = texture.measure_pattern(_blur_others(window, source))
    judged = verdict.judge_material(info.name, float(own.sum()) / parts.tile_side**2, filled, pattern)
    return Material(info, made, made_grid, filled, judged, pattern)


def _fill_window(
    window: GroundMaps, source: Bool[Array, "m m"], tile_side: float, rng: np.random.Generator
) -> CellSources | None:
    colours = energy.make_colour_layer(window.colour)
    hidden = energy.make_occluder_layer(window.cover)
    terms = energy.SeamEnergy("colour", 0.0, colours, None, hidden).terms(1.0)
    plan = layout.plan_layout(window.cells, 1, min(1.0, tile_side / window.cells), 0.125)
    features = patches.make_guidance(window.colour, window.height, np.zeros(source.shape), plan).features
    return fill_cells(features, terms, source, _choose_patch(window, source), rng)


def _rescale_shares(materials: list[Material]) -> list[Material]:
    """Shares that sum to 1 where a material was left out."""
    total = sum(each.info.share for each in materials)
    return [replace(each, info=replace(each.info, share=each.info.share / total)) for each in materials]


def choose_window(own: Bool[Array, "m m"], tile_side: float) -> tuple[int, int, int]:
    """South-western cell (row, column) and side of the square that a material's exemplar is made of.

    The largest square that the material fills by OWN_SHARE, or else the smallest one; wide enough that patches of a
    tile's side have places to choose from.
    """
    m = len(own)
    unit = int(np.gcd(m, BLOCK))
    least = min(m, ROOM * tile_side)
    sides = sorted({min(m, -(-int(max(share * m, least)) // unit) * unit) for share in WINDOWS}, reverse=True)
    for side in sides:
        counts = box_sums(own, side)
        if counts.max() >= OWN_SHARE * side * side or side == sides[-1]:
            row, column = np.unravel_index(int(counts.argmax()), counts.shape)
            return int(row), int(column), side
    raise AssertionError("the last side is always taken")


def _choose_patch(maps: GroundMaps, source: Bool[Array, "m m"]) -> int:
    """Side of a patch in cells: some scales of the texture, and not too wide for the source."""
    width = 2 * float(distance_transform_edt(np.pad(source, 1)).max())
    scale = _texture_scale(maps, source)
    return int(np.clip(round(PATCH * scale), SMALLEST_PATCH, max(SMALLEST_PATCH, width / 3)))


def _texture_scale(maps: GroundMaps, source: Bool[Array, "m m"]) -> float:
    """Scale of the texture in cells."""
    return texture.measure_texture_scale(_blur_others(maps, source))


def _blur_others(maps: GroundMaps, source: Bool[Array, "m m"]) -> Float[Array, "m m 3"]:
    """The colours of a source; cells of other ground have its blurred colour."""
    blur = texture.TREND * len(source)
    soft = [extraction.blur_over(layer, source, blur) for layer in np.moveaxis(maps.colour, -1, 0)]
    return np.where(source[..., None], maps.colour, np.dstack(soft))


def _measure_borders(parts: _Parts, number: int) -> tuple[float | None, float | None]:
    """Fray and bend of a material's borders, in world units."""
    classes, spacing = parts.classes, parts.grid.spacing
    counted = parts.maps.known & ~classes.excluded & ~classes.occupied
    own = classes.materials == number
    fray = measure_fray(parts.features, own, counted, parts.tile_side)
    bend = measure_bend(own, counted, parts.tile_side)
    return None if fray is None else fray * spacing, None if bend is None else bend * spacing


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
