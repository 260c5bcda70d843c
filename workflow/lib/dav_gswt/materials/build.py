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
from dav_gswt.materials import extraction, left_out, outlines, segmentation
from dav_gswt.materials.borders import measure_share, measure_strays
from dav_gswt.materials.classes import GroundClasses, classify_ground
from dav_gswt.materials.extraction import fill_cells
from dav_gswt.materials.left_out import LeftOut
from dav_gswt.materials.maps import HALF, GroundMaps, measure_ground, read_masks, resample, unite
from dav_gswt.materials.model import MaterialInfo
from dav_gswt.materials.shading import Sun
from dav_gswt.reconstruction.ground import Ground
from dav_gswt.tiles import compose, energy, layout, patches, texture
from dav_gswt.tiles.layout import Exemplar

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
    left_out: tuple[LeftOut, ...] = ()


@dataclass(frozen=True)
class GroundPlan:
    """What the ground of an exemplar is: what materials are cut from, before any is.

    Attributes:
        maps, classes: of the exemplar.
        sources: the cells that each material is made of; none of a material that is left out.
        tile_side: in cells.
        whole: all of the ground is one material, and is tiled as it is.
        left_out: things that stand or are sunk, are cut off, or were seen from above only.
    """

    maps: GroundMaps
    classes: GroundClasses
    sources: list[Bool[Array, "m m"]]
    tile_side: float
    whole: bool = False
    left_out: tuple[LeftOut, ...] = ()


@dataclass(frozen=True)
class Cutting:
    """A part of the ground that something is cut from. own: its cells there; grid: its exemplar is that part."""

    field: GaussianField
    grid: Ground
    maps: GroundMaps
    own: Bool[Array, "n n"]


@dataclass(frozen=True)
class FocusedFields:
    """Windows of the ground that were fitted by themselves: field and grid of each, and whether tiles are cut from it.

    maps: of the exemplar, as the windows show it, and around them as the draft and the photos do.
    """

    windows: list[tuple[GaussianField, Ground]]
    tiled: list[bool]
    maps: GroundMaps

    def find_window(self, own: Bool[Array, "m m"], tiled: bool) -> int | None:
        """The window that holds most of these cells of the maps; None where none holds any.

        tiled: only windows that tiles are cut from; else one must hold them all.
        """
        counts = [int(own[find_cells(self.maps.exemplar, grid)].sum()) for _, grid in self.windows]
        if tiled:
            counts = [count * each for count, each in zip(counts, self.tiled, strict=True)]
        best = int(np.argmax(counts))
        return best if counts[best] >= (1 if tiled else own.sum()) else None


def find_cells(place: Exemplar, grid: Ground) -> tuple[slice, slice]:
    """The cells of an exemplar whose centres lie inside the exemplar of a grid."""
    west, south, side = grid.exemplar
    ends = [
        np.ceil((np.array([low, low + side]) - start) / place.spacing - 0.5).astype(int).clip(0, place.cells)
        for low, start in ((south, place.south), (west, place.west))
    ]
    return slice(*ends[0].tolist()), slice(*ends[1].tolist())


def plan_ground(maps: GroundMaps, layered: bool, mask_files: Mapping[str, Path | str] | None = None) -> GroundPlan:
    """Tell the materials and objects of an exemplar apart.

    One material without objects is kept as it is. So are, with a warning, ground of which nothing would be left to
    tile, and a field without a ground layer (an imported field, or ground that is too rough for a layer).

    Args:
        layered: whether the field has a ground layer.
        mask_files: by material, or `exclude`; see `maps.read_masks`.
    """
    if not layered:
        _log.warning("materials: this field has no ground layer: all of the ground is tiled as one")
        return _plan_whole(maps)
    masks = read_masks(mask_files, maps.cells) if mask_files else None
    relief = [] if masks and masks.materials else left_out.find_relief(maps)  # people may name what stands
    standing = unite([cells for _, cells in relief], maps.known.shape)
    classes = classify_ground(maps, masks, standing)
    free = replace(maps, known=maps.known & ~classes.excluded)
    refined = outlines.refine_footprints(free, classes.footprints)
    kept, flawed = left_out.drop_flawed(refined, maps, ~maps.known | standing, classes.excluded)
    # what stood out beside the closer outlines is shown nowhere
    before, classes = classes, replace(classes, footprints=kept)
    classes = replace(classes, excluded=before.excluded | (before.occupied & ~classes.occupied))
    lost = tuple(LeftOut(reason, float(cells.mean())) for reason, cells in [*relief, *flawed])
    for phrase in left_out.describe_left_out([vars(each) for each in lost]):
        _log.info("left out: %s", phrase)
    sources = [_ignore_scarce(classes, k) for k in range(classes.number)]
    if all(source.all() for source in sources) and masks is None:
        return _plan_whole(maps, classes.sun)
    if not any(source.any() for source in sources):
        _warn_of_nothing()
        return _plan_whole(maps, classes.sun)
    return GroundPlan(maps, classes, sources, choose_tile_side(maps, sources), left_out=lost)


def _warn_of_nothing() -> None:
    _log.warning("materials: nothing is left to tile (shade, objects or cut off): all of the ground is tiled as one")


def _plan_whole(maps: GroundMaps, sun: Sun | None = None) -> GroundPlan:
    """All of the ground as one material."""
    everything, nothing = np.ones(maps.known.shape, bool), np.zeros(maps.known.shape, bool)
    classes = GroundClasses(nothing.astype(int), nothing.astype(int), [], nothing, ["material0"], sun)
    return GroundPlan(maps, classes, [everything], choose_tile_side(maps, [everything]), True)


def find_materials(
    field: GaussianField,
    grid: Ground,
    seed: int,
    mask_files: Mapping[str, Path | str] | None = None,
    focused: FocusedFields | None = None,
) -> FoundMaterials:
    """Find the materials of a field's exemplar and the objects on them, and cut both out: see `plan_ground`.

    focused: fields of windows that they are cut from; None: from the field itself.
    """
    maps = measure_ground(field, grid) if focused is None else focused.maps
    plan = plan_ground(maps, bool(field.ground.any()), mask_files)
    if plan.whole:
        return _keep_whole(field, grid, plan, focused)
    features = segmentation.describe_cells(plan.maps.colour)[..., :3]
    kept: dict[int, Material] = {}
    for k, cutting in progress(_find_cuttings(field, grid, plan, focused).items(), "fill materials"):
        made = _make_material(plan, features, k, cutting, np.random.default_rng([seed, k]))
        kept |= {} if made is None else {k: made}
    if not kept:
        _warn_of_nothing()
        return _keep_whole(field, grid, _plan_whole(plan.maps, plan.classes.sun), focused)
    total = sum(each.info.share for each in kept.values())
    materials = [replace(each, info=replace(each.info, share=each.info.share / total)) for each in kept.values()]
    objects = _extract_objects(plan, field, grid, {k: place for place, k in enumerate(kept)}, focused)
    side = plan.tile_side * plan.maps.exemplar.spacing / materials[0].grid.spacing
    return replace(_report(plan.maps, plan.classes, side, materials, objects), left_out=plan.left_out)


def _find_cuttings(
    field: GaussianField, grid: Ground, plan: GroundPlan, focused: FocusedFields | None
) -> dict[int, Cutting]:
    """What each material is cut from, by number; materials that are left out have none."""
    found = {}
    for number, own in enumerate(plan.sources):
        if not own.any():
            continue
        if focused is None:
            row, column, cells = choose_window(own, plan.tile_side)
            small = replace(grid, first_row=grid.first_row + row, first_column=grid.first_column + column, cells=cells)
            source = own[row : row + cells, column : column + cells]
            found[number] = Cutting(field, small, plan.maps.crop(row, column, cells), source)
        else:
            window = focused.find_window(own, True)
            if window is None:
                _log.warning("%s lies in no window that was fitted: it is left out", plan.classes.names[number])
                continue
            maps = measure_ground(*focused.windows[window])
            source = (resample(own, plan.maps.exemplar, maps.exemplar) >= HALF) & maps.known
            found[number] = Cutting(*focused.windows[window], maps, source)
    return found


def _keep_whole(field: GaussianField, grid: Ground, plan: GroundPlan, focused: FocusedFields | None) -> FoundMaterials:
    """All of the ground as one material: as it is, or its window."""
    maps, side = plan.maps, None
    colour = [float(value) for value in maps.colour.mean((0, 1))]
    info = MaterialInfo("material0", 1.0, maps.cells * maps.exemplar.spacing, colour, None)
    judged = judge_material(info.name, (maps.cells / plan.tile_side) ** 2, 0.0)
    if focused is not None:
        field, grid = focused.windows[0]
        side = plan.tile_side * maps.exemplar.spacing / grid.spacing
    return _report(maps, plan.classes, side, [Material(info, field, grid, 0.0, judged)], [])


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


def _make_material(
    plan: GroundPlan, features: Float[Array, "m m k"], number: int, cutting: Cutting, rng: np.random.Generator
) -> Material | None:
    """The exemplar of one material, made of its own cells; None where it has no room for a patch.

    features: weighed CIELAB of all cells.
    """
    window, source = cutting.maps, cutting.own
    name, cells = plan.classes.names[number], cutting.grid.cells
    tile_side = plan.tile_side * plan.maps.exemplar.spacing / cutting.grid.spacing
    hidden = energy.make_occluder_layer(window.cover)
    terms = energy.SeamEnergy("colour", 0.0, energy.make_colour_layer(window.colour), None, hidden).terms(1.0)
    areas = layout.plan_layout(cells, 1, min(1.0, tile_side / cells), 0.125)
    guide = patches.make_guidance(window.colour, window.height, np.zeros(source.shape), areas).features
    sources = fill_cells(guide, terms, source, _choose_patch(window, source), rng) if source.any() else None
    if sources is None:
        _log.warning("%s is too small and narrow to be tiled; it is left out", name)
        return None
    made, made_grid = extraction.extract_exemplar(cutting.field, cutting.grid, window, sources, source)
    filled, own, spacing = float(sources.copied.mean()), plan.sources[number], plan.maps.exemplar.spacing
    colour = [float(value) for value in plan.maps.colour[own].mean(0)]
    counted = plan.maps.known & ~plan.classes.excluded & ~plan.classes.occupied
    whole = plan.classes.materials == number  # with the excluded ground in it: shade of a tree parts no material
    patch_scale = _measure_patches(whole) * spacing
    share = measure_share(features, whole, counted, plan.tile_side)
    strays = measure_strays(share, counted, plan.tile_side)
    strays = strays and [stray * spacing for stray in strays]
    info = MaterialInfo(name, float(plan.classes.shares[number]), patch_scale, colour, strays)
    judged = judge_material(info.name, float(own.sum()) / plan.tile_side**2, filled)
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
    counts = {side: patches.box_sums(own, side, side) for side in sides}
    side = next((side for side in sides if counts[side].max() >= OWN_SHARE * side * side), sides[-1])
    row, column = np.unravel_index(int(counts[side].argmax()), counts[side].shape)
    return int(row), int(column), side


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


def _extract_objects(
    plan: GroundPlan, field: GaussianField, grid: Ground, index: dict[int, int], focused: FocusedFields | None
) -> list[ExtractedObject]:
    """All objects; index: new number of each material that is kept. Others' objects stand on the largest one."""
    objects, classes, spacing = [], plan.classes, plan.maps.exemplar.spacing
    areas = classes.shares * float((~classes.excluded).sum()) * spacing**2
    windows = [(field, grid)] if focused is None else focused.windows
    opened: dict[int, tuple[GroundMaps, compose.BinnedLevel]] = {}
    for number, footprint in enumerate(classes.footprints):
        place = 0 if focused is None else focused.find_window(footprint.cells, False)
        if place is None:
            continue
        own_field, own_grid = windows[place]
        if place not in opened:
            maps = plan.maps if focused is None else measure_ground(own_field, own_grid)
            opened[place] = maps, extraction.bin_standing(own_field, own_grid, maps)
        maps, standing = opened[place]
        cells = resample(footprint.cells, plan.maps.exemplar, maps.exemplar) >= HALF
        own = extraction.extract_object(own_field, own_grid, maps, standing, replace(footprint, cells=cells))
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
        reason = f"{excluded:.0%} of the ground is shade, rare or cut off, and not in the terrain"
        return MaterialVerdict("marginal", reason)
    many = "1 material" if len(verdicts) == 1 else f"{len(verdicts)} materials"
    scarce = [name for name, verdict in verdicts.items() if verdict.grade == "no"]
    lacking = f"; of {' and '.join(scarce)} there is too little" if scarce else ""
    return MaterialVerdict(grade, f"{many}, {excluded:.0%} of the ground is not in the terrain{lacking}")
