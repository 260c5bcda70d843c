"""The tile set of a field: trends are removed, patches searched and cut, and every level is composed of them."""

import logging
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from jaxtyping import Float, Int, UInt8
from numpy import ndarray as Array
from scipy.ndimage import distance_transform_edt

from dav_gswt.errors import InputError
from dav_gswt.field import SH0, GaussianField
from dav_gswt.lod.levels import AUTO, Levels
from dav_gswt.logs import progress
from dav_gswt.reconstruction import top_view
from dav_gswt.tiles import (
    coarse_levels,
    compose,
    energy,
    layout,
    occluders,
    patches,
    poisson_blending,
    search,
    semantics,
    texture,
    trends,
)
from dav_gswt.tiles.layout import EDGES, Exemplar, Layout
from dav_gswt.tiles.report import EnergyReport, PlacesReport, TileReport

_log = logging.getLogger(__name__)

WARN_UNCERTAINTY = 0.5  # mean of a tile, above which a warning is logged


@dataclass(frozen=True)
class TilingOptions:
    """How a tile set is cut.

    Attributes:
        share: tile side over the exemplar's side, or AUTO: by the scale of the exemplar's texture.
        strip: half-width of the strips over the tile's side, below 1/5, or AUTO.
        variants: centres per edge colouring.
        trend: width of the low-pass that is removed, in tile sides.
        candidates: places that a search compares.
        tries: the best of them that are cut before one is taken.
        kind: the energy of seams, one of `energy.KINDS`.
        slope: of the weight of colour as a function of uncertainty.
        source: what the semantics are made of.
        levels: of the tiles, a number or AUTO; None: as many as are given.
        corrected: steps across seams are spread out (`poisson_blending`).
        relabel: see `search.SearchProblem`.

    Raises: ValueError: an unknown kind.
    """

    share: float | str = 0.5
    strip: float | str = 0.125
    variants: int = 1
    trend: float = 0.2
    candidates: int = 192
    tries: int = 4
    kind: str = "semantic"
    slope: float = 2.0
    source: semantics.SemanticSource = semantics.SemanticSource()
    levels: int | str | None = None
    corrected: bool = True
    relabel: search.Relabel | None = None

    def __post_init__(self) -> None:
        if self.kind not in energy.KINDS:
            raise ValueError(f"{self.kind!r} is no energy of seams: {', '.join(energy.KINDS)}")

    @classmethod
    def from_config(
        cls, tiling: Mapping[str, Any], source: semantics.SemanticSource, levels: int | str | None = None
    ) -> "TilingOptions":
        """The options of an entry of the config's tilings."""
        own = {"share": "tile", "kind": "energy"}
        given = {key: tiling[name] for key in vars(cls()) if (name := own.get(key, key)) in tiling}
        return cls(**given, source=source, levels=levels)


def make_generator(seed: int, tiling: Mapping[str, Any], material: int = 0) -> np.random.Generator:
    """The generator of a tile set, from the workflow's seed and, where they are not 0, the tiling's replicate number
    and the material's."""
    replicate = tiling.get("replicate") or 0
    if material:
        return np.random.default_rng([seed, replicate, material])
    return np.random.default_rng([seed, replicate] if replicate else [seed])


@dataclass(frozen=True)
class TileSet:
    """16 C tiles at every level, in world units from each tile's south-western corner.

    Attributes:
        side: width of a tile; spacing: width of a finest cell.
        fields: fields[level][tile].
        labels: [tile, y, x], row 0 in the south: which patch each finest cell shows (`layout.LABELS`).
        shifts: per tile and label, what to add to a cell (x, y) of the tile for the exemplar's cell.
        uncertainty: mean over each tile's cells.
        report: what was chosen and what it cost.
    """

    side: float
    spacing: float
    fields: list[list[GaussianField]]
    labels: UInt8[Array, "tiles n n"]
    shifts: Int[Array, "tiles 9 2"]
    uncertainty: Float[Array, "tiles"]
    report: TileReport

    @property
    def variants(self) -> int:
        return len(self.labels) // EDGES


def cut_levels(levels: Levels, options: TilingOptions, rng: np.random.Generator) -> TileSet:
    """Cut the tile set of a field's levels, as they look from straight above. Raises: InputError: see `cut_tiles`."""
    grid = levels.grids[0]
    above = top_view.render_exemplar(levels.fields[0], grid)
    maps = above.colour_or_nan(), above.uncertainty
    return cut_tiles(levels.fields, Exemplar.from_grid(grid), *maps, options, rng)


def cut_materials(
    sets: Sequence[Levels],
    options: TilingOptions,
    tile_side: float | None,
    make_rng: Callable[[int], np.random.Generator],
) -> list[TileSet]:
    """Cut a tile set of each material: all of one side, with as many levels, and the same mean height.

    Args:
        sets: the levels of each material's exemplar; cells of all are equally wide.
        tile_side: in cells, where the options leave it to the texture; None: by the texture of the first material.
        make_rng: the generator of a material, by number.
    Raises: InputError: see `cut_tiles`.
    """
    numbers = [own.wanted for own in sets if isinstance(own.wanted, int)]
    options = replace(options, levels=min(numbers) if numbers else AUTO)
    tiles: list[TileSet] = []
    side = tile_side if options.share == AUTO else None
    for number, own in enumerate(sets):
        share = options.share if side is None else min(1.0, side / own.grids[0].cells)
        tiles.append(cut_levels(own, replace(options, share=share), make_rng(number)))
        side, options = tiles[0].report.layout.side, replace(options, levels=len(tiles[0].fields))
    if len({(len(own.fields), own.report.layout.side) for own in tiles}) > 1:
        raise InputError(
            "tiles: a material's exemplar holds no such tiles: choose a smaller `tile` or `materials: one`"
        )
    return [_raise_to(own, _mean_height(tiles[0])) for own in tiles]


def _mean_height(tiles: TileSet) -> float:
    return float(np.mean([field.means[:, 2].astype(float).mean() for field in tiles.fields[0]]))


def _raise_to(tiles: TileSet, height: float) -> TileSet:
    """The tiles at another mean height."""
    by = np.array([0, 0, height - _mean_height(tiles)], np.float32)
    if not by.any():
        return tiles
    fields = [[replace(field, means=field.means + by) for field in level] for level in tiles.fields]
    return replace(tiles, fields=fields)


def cut_tiles(
    levels: list[GaussianField],
    exemplar: Exemplar,
    colour: Float[Array, "m m 3"],
    uncertainty: Float[Array, "m m"],
    options: TilingOptions,
    rng: np.random.Generator,
) -> TileSet:
    """Cut the tile set of a field.

    Args:
        levels: finest first; level l's ground has cells of 2^l spacings from the exemplar's corner. Levels whose cells
            are wider than a block are not used: such levels are merged from each tile's own cells.
        colour, uncertainty: seen from straight above, one value a finest cell, **row 0 in the south**. Uncertainty in
            [0, 1]; NaN where nothing is known: a hole takes the colour of the nearest cell, and is shown only where no
            other place serves.
    Raises: InputError: the exemplar is too small for a tile, a level has no Gaussian in it, or nothing is known of any
        cell.
    """
    shape = (exemplar.cells, exemplar.cells)
    if colour.shape[:2] != shape or uncertainty.shape != shape:
        raise ValueError(f"maps of {colour.shape[:2]} and {uncertainty.shape} cells for an exemplar of {shape}")
    filled, uncertainty = _fill_holes(colour, uncertainty)
    scale = texture.measure_texture_scale(filled)
    plan = _plan_layout(options, scale, exemplar, len(levels))
    _, height = compute_ground_maps(levels[0], exemplar)
    trend = trends.fit_trend(colour, height, exemplar, options.trend * plan.side)
    binned = _bin_levels(levels[: plan.composed_levels], exemplar, trend)
    hidden = energy.make_occluder_layer(occluders.compute_cover(levels[0], exemplar, height))
    colour = np.clip(filled - trend.colour, 0, 1).astype(float)
    height = np.nan_to_num(height - trend.height, nan=float(np.nanmean(height)))
    seam_energy, energy_report = _make_seam_energy(options, colour, hidden)
    guide = patches.make_guidance(colour, height, uncertainty, plan)
    problem = search.SearchProblem(plan, guide, seam_energy, options.candidates, options.tries, options.relabel)
    found = search.search_patches(problem, options.variants, rng)
    shifts = np.stack([layout.label_shifts(plan, found.places, tile) for tile in range(len(found.tiles))])
    corrections = _solve_corrections(plan, found, shifts, poisson_blending.make_soft_maps(colour, height))
    corrections *= options.corrected
    fields, raised = _compose_tiles(binned, plan, found.labels, shifts, corrections)
    report = TileReport(
        places=PlacesReport.from_places(found.places),
        strip_energy=[strip.seam.energy for strip in found.strips],
        strip_gamma=[strip.gamma for strip in found.strips],
        tile_energy=[tile.centre.seam.energy for tile in found.tiles],
        tile_gamma=[tile.centre.gamma for tile in found.tiles],
        layout=plan,
        texture=scale * exemplar.spacing,
        raised=raised.tolist(),
        energy=energy_report,
        trend={"colour": float(np.ptp(trend.colour)), "height": float(np.ptp(trend.height))},
        correction=np.abs(corrections).max((0, 1, 2)).tolist(),
    )
    means = _average_uncertainty(uncertainty, found.labels, shifts)
    return TileSet(plan.side * exemplar.spacing, exemplar.spacing, fields, found.labels, shifts, means, report)


def _bin_levels(levels: list[GaussianField], exemplar: Exemplar, trend: trends.Trend) -> list[compose.BinnedLevel]:
    """The levels without the trend, sorted by the exemplar's cells."""
    return [
        _check_level(compose.bin_gaussians(trends.remove_trend(field, trend), exemplar, 2**number), number)
        for number, field in enumerate(levels)
    ]


def _average_uncertainty(uncertainty: Array, labels: Array, shifts: Array) -> Float[Array, "tiles"]:
    """Mean uncertainty of every tile's cells; a warning where a tile shows uncertain ground."""
    means = np.array([uncertainty[layout.source_cells(*pair)].mean() for pair in zip(labels, shifts, strict=True)])
    if means.max() > WARN_UNCERTAINTY:
        _log.warning(
            "the tiles show uncertain ground (mean uncertainty %.2f to %.2f): choose a smaller `tile` in the config's "
            "tilings, or take more photos",
            means.min(),
            means.max(),
        )
    return means


def _compose_tiles(
    binned: list[compose.BinnedLevel], plan: Layout, labels: Array, shifts: Array, corrections: Array
) -> tuple[list[list[GaussianField]], Float[Array, "tiles"]]:
    """fields[level][tile] of all levels, and by how much each tile was raised."""
    spacing = binned[0].exemplar.spacing
    tiles = [
        [_compose_level(level, labels[tile], shifts[tile], corrections[tile]) for level in binned]
        for tile in progress(range(len(labels)), "compose tiles")
    ]
    tiles, raised = compose.equalise_heights(tiles, plan.side * spacing)
    tiles = [_append_merged_levels(tile, plan, spacing) for tile in tiles]
    return [list(level) for level in zip(*tiles, strict=True)], raised


def _make_seam_energy(
    options: TilingOptions, colour: Float[Array, "m m 3"], occluder_layer: energy.ColourLayer | None
) -> tuple[energy.SeamEnergy, EnergyReport]:
    """The energy that seams are cut with, and its description for seams.json."""
    colour_layer = energy.make_colour_layer(colour)
    weight = energy.OCCLUDER_WEIGHT if occluder_layer is not None else None
    scales = {"colour": colour_layer.unit}
    if options.kind == "colour":
        seam_energy = energy.SeamEnergy(options.kind, options.slope, colour_layer, None, occluder_layer)
        return seam_energy, EnergyReport(options.kind, scales, energy.EPS, weight)
    semantic = semantics.make_semantic_layer(colour, options.source)
    scales["semantics"] = semantic.unit
    gamma, slope = (0.5, None) if options.kind == "semantic-nogamma" else (None, options.slope)
    seam_energy = energy.SeamEnergy(options.kind, options.slope, colour_layer, semantic, occluder_layer)
    return seam_energy, EnergyReport(options.kind, scales, energy.EPS, weight, gamma, slope, semantic.description)


def _plan_layout(options: TilingOptions, scale: float, exemplar: Exemplar, fitted: int) -> Layout:
    """Sizes of tiles for a number of fitted levels; where they are AUTO, by the texture's scale in cells."""
    by_texture = texture.choose_sizes(scale / exemplar.cells)
    share, strip = (
        automatic if isinstance(value, str) else value
        for value, automatic in zip((options.share, options.strip), by_texture, strict=True)
    )
    if AUTO in (options.share, options.strip):
        _log.info("texture of scale %.3g: tiles of %.2f of the exemplar", scale * exemplar.spacing, share)
    return layout.plan_layout(exemplar.cells, options.levels or fitted, share, strip, fitted)


def _fill_holes(colour: Array, uncertainty: Array) -> tuple[Float[Array, "m m 3"], Float[Array, "m m"]]:
    """Colours without holes, and uncertainties in [0, 1]; a hole takes the nearest cell's colour and is uncertain.

    Raises: InputError: there is nothing but holes or uncertain ground.
    """
    known = np.asarray(np.isfinite(colour).all(-1))
    uncertainty = np.where(known, np.clip(np.nan_to_num(uncertainty, nan=1.0), 0, 1), 1.0).astype(float)
    if not (uncertainty < 1).any():
        raise InputError(
            "tiles: nothing is known of the exemplar: no photo shows its ground, or all of it is masked; take photos "
            "of it, or leave `masks` out of the scene"
        )
    if not known.all():
        _log.warning("%d of %d cells of the exemplar are holes", (~known).sum(), known.size)
        rows, columns = distance_transform_edt(~known, return_distances=False, return_indices=True)
        colour = colour[rows, columns]
    return colour, uncertainty


def _solve_corrections(
    plan: Layout, found: search.SearchResult, shifts: Array, ground: poisson_blending.SoftMaps
) -> Float[Array, "t n n 4"]:
    """Correction of every tile's cells, so that no step is left along its seams; strips are solved first."""
    strips = []
    for upright, masks, places in (
        (True, found.vertical, found.places.vertical),
        (False, found.horizontal, found.places.horizontal),
    ):
        pair = [
            layout.strip_labels(plan, mask, place, found.places.corner, upright)
            for mask, place in zip(masks, places, strict=True)
        ]
        strips.append(np.stack([poisson_blending.solve_strip(labels, shift, plan, ground) for labels, shift in pair]))
    corrections = []
    for tile, (labels, shift) in enumerate(zip(found.labels, shifts, strict=True)):
        border = poisson_blending.border_values(plan, strips[0], strips[1], tile)
        corrections.append(poisson_blending.solve_tile(labels, shift, border, plan, ground))
    return np.stack(corrections)


def _compose_level(level: compose.BinnedLevel, labels: Array, shift: Array, correction: Array) -> GaussianField:
    """One tile at one level, corrected. A coarser level takes the majority of the finest labels."""
    majority = compose.coarsen_labels(labels, level.cell)
    splats = compose.compose_tile(level, majority, shift)
    change = poisson_blending.coarsen_correction(correction, labels, majority)
    return poisson_blending.apply_correction(splats, change, level.cell * level.exemplar.spacing)


def _append_merged_levels(tile: list[GaussianField], plan: Layout, spacing: float) -> list[GaussianField]:
    """A tile's levels, with those whose cells are wider than a block merged from its own cells."""
    for number in range(len(tile), plan.levels):
        cell = 2 ** (number - 1)
        tile = [*tile, coarse_levels.merge_cells(tile[-1], plan.side // cell, cell * spacing)]
    return tile


def compute_ground_maps(field: GaussianField, exemplar: Exemplar) -> tuple[Float[Array, "m m 3"], Float[Array, "m m"]]:
    """Mean colour and height of each finest cell's ground discs (all Gaussians', if none is ground); NaN for none."""
    ground = field[field.ground] if field.ground.any() else field
    level = compose.bin_gaussians(ground, exemplar, 1)
    count = np.diff(level.start)
    cell = np.repeat(np.arange(len(count)), count)
    values = [*level.field.sh[:, 0].T * SH0 + 0.5, level.field.means[:, 2]]
    with np.errstate(invalid="ignore"):
        maps = [(np.bincount(cell, v, len(count)) / count).reshape(exemplar.cells, exemplar.cells) for v in values]
    return np.stack(maps[:3], -1), maps[3]


def _check_level(level: compose.BinnedLevel, number: int) -> compose.BinnedLevel:
    if not len(level.field):
        raise InputError(f"level {number}: no Gaussian lies over the exemplar; is its field from another ground.json?")
    held = compose.count_discs(level)
    if held.any() and (held != 1).any():
        _log.warning("level %d: %d of %d cells do not hold one ground disc", number, (held != 1).sum(), held.size)
    return level
