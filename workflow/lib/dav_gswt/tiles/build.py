"""The tile set of a field: trends are removed, patches searched and cut, and every level is composed of them."""

import logging
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from jaxtyping import Float, Float32, Int, UInt8
from numpy import ndarray as Array
from scipy.ndimage import distance_transform_edt

from dav_gswt.errors import InputError
from dav_gswt.field import GaussianField
from dav_gswt.lod.store import AUTO, Levels
from dav_gswt.logs import progress
from dav_gswt.reconstruction import top_view
from dav_gswt.tiles import compose, energy, layout, patches, periods, poisson_blending, search, semantics, texture
from dav_gswt.tiles.layout import EDGES, Exemplar, Layout

_log = logging.getLogger(__name__)

WARN_UNCERTAINTY = 0.5  # mean of a tile, above which a warning is logged
MOST_RESIZED = 0.3  # logarithm of a tile's size over the wanted one, for whole rows
SIDES = 64  # sides between 0 and the wanted one that are tried, at most
SIZE_COST = 0.2  # of that logarithm, where the norm of the exemplar's change costs 1


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
        kind: the energy of seams, see `energy.SeamEnergy`.
        slope: of the weight of colour as a function of uncertainty.
        source: what the semantics are made of.
        levels: of the tiles, a number or AUTO; None: as many as are given.
        corrected: steps across seams are spread out (`poisson_blending`).
        relabel: see `search.SearchProblem`.
        pattern: of the exemplar, whose levels are turned already.
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
    pattern: periods.Pattern | None = None

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
class Recipe:
    """What the tiles of the levels up to a block's are composed of.

    Attributes:
        levels: the exemplar without its trend, by cell.
        trend: what was taken out of it.
        corrections: what each tile's finest cells change of colour (3) and height; coarser cells take the mean.
    """

    levels: list[compose.BinnedLevel]
    trend: texture.Trend
    corrections: Float32[Array, "tiles n n 4"]


@dataclass(frozen=True)
class TileSet:
    """16 C tiles at every level, in world units from each tile's south-western corner.

    Attributes:
        side: width of a tile; spacing: width of a finest cell.
        fields: fields[level][tile].
        labels: [tile, y, x], row 0 in the south: which patch each finest cell shows (`layout.LABELS`).
        shifts: per tile and label, what to add to a cell (x, y) of the tile for the exemplar's cell.
        uncertainty: mean over each tile's cells.
        report: what was chosen and what it cost, as JSON.
        recipe: of composed tiles; None: they are known by their Gaussians alone.
    """

    side: float
    spacing: float
    fields: list[list[GaussianField]]
    labels: UInt8[Array, "tiles n n"]
    shifts: Int[Array, "tiles 9 2"]
    uncertainty: Float[Array, "tiles"]
    report: dict[str, Any]
    recipe: Recipe | None = None

    @property
    def variants(self) -> int:
        return len(self.labels) // EDGES

    @property
    def layout(self) -> Layout:
        """Sizes in cells."""
        return Layout.from_dict(self.report["layout"])


def cut_levels(levels: Levels, options: TilingOptions, rng: np.random.Generator, fixed: bool = False) -> TileSet:
    """Cut the tile set of a field's levels, as they look from straight above; of regular ground, in whole periods.

    fixed: tiles must have the side that the options say. Raises: InputError: see `cut_tiles`.
    """
    above = top_view.render_exemplar(levels.fields[0], levels.grids[0])
    if len(waves := periods.find_waves(above.colour_or_nan())):
        options = _fit_periods(waves, levels, above, options, fixed)
        if options.pattern is not None:
            levels = periods.turn_levels(levels, options.pattern.turn, options.pattern.cells)
            above = top_view.render_exemplar(levels.fields[0], levels.grids[0])
    exemplar = Exemplar.from_grid(levels.grids[0])
    return cut_tiles(levels.fields, exemplar, above.colour_or_nan(), above.uncertainty, options, rng)


def _fit_periods(
    waves: Float[Array, "k 2"], levels: Levels, above: top_view.TopView, options: TilingOptions, fixed: bool
) -> TilingOptions:
    """The options with the pattern and the sizes for which the exemplar changes least; unchanged where none will do."""
    grid, fitted = levels.grids[0], len(levels.fields)
    colour, _ = _fill_holes(above.colour_or_nan(), above.uncertainty)
    plan = _plan_layout(options, texture.measure_texture_scale(colour), Exemplar.from_grid(grid), fitted)
    rows, strip, cell = periods.describe_rows(waves, grid.spacing), plan.strip / plan.side, 2 ** (plan.levels - 1)
    found = []
    step = max(cell, plan.side // SIDES // cell * cell)
    for side in [plan.side] if fixed else range(plan.side % step or step, grid.cells + 1, step):
        if (size := abs(float(np.log(side / plan.side)))) > MOST_RESIZED:
            continue
        pattern = periods.fit_pattern(waves, grid.cells, side, 2 ** (fitted - 1), plan.block)
        if pattern and layout.plan_layout(pattern.cells, plan.levels, side / pattern.cells, strip, fitted).side == side:
            found.append((pattern.cost + SIZE_COST * size, pattern))
    if not found:
        _log.warning("rows %s: they will break, as no tile is a whole number of them", rows)
        return options
    pattern = min(found, key=lambda each: each[0])[1]
    said = "rows %s: tiles of %s cross %s (east x north); the ground is turned by %.1f degrees and stretched by %.1f %%"
    crossed = " and ".join(f"{abs(east)} x {abs(north)}" for east, north in pattern.counts)
    angle, stretch = periods.measure_turn(pattern.turn)
    _log.info(said, rows, f"{pattern.side * grid.spacing:.3g}", crossed, angle, 100 * stretch)
    sizes = {"share": pattern.side / pattern.cells, "strip": strip, "levels": plan.levels}
    return replace(options, **sizes, pattern=pattern)


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
        tiles.append(cut_levels(own, replace(options, share=share), make_rng(number), bool(tiles)))
        side, options = tiles[0].layout.side, replace(options, levels=len(tiles[0].fields))
    if len({(len(own.fields), own.layout.side) for own in tiles}) > 1:
        raise InputError(
            "tiles: a material's exemplar holds no such tiles: choose a smaller `tile` or `materials: one`"
        )
    goal = _mean_height(tiles[0])
    return [tiles[0], *(_raise_to(own, goal) for own in tiles[1:])]


def _mean_height(tiles: TileSet) -> float:
    return float(np.mean([field.means[:, 2].astype(float).mean() for field in tiles.fields[0]]))


def _raise_to(tiles: TileSet, height: float) -> TileSet:
    """The tiles at another mean height."""
    by, recipe = np.array([0, 0, 0, height - _mean_height(tiles)], np.float32), tiles.recipe
    assert recipe is not None
    recipe = replace(recipe, corrections=recipe.corrections + by)
    return replace(tiles, recipe=recipe, fields=compose_tiles(recipe, tiles.layout, tiles.labels, tiles.shifts))


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
    filled, uncertainty = _fill_holes(colour, uncertainty)
    scale = texture.measure_texture_scale(filled)
    plan = _plan_layout(options, scale, exemplar, len(levels))
    _, height = compose.compute_ground_maps(levels[0], exemplar)
    trend = texture.fit_trend(colour, height, exemplar, options.trend * plan.side)
    flat = [texture.remove_trend(field, trend) for field in levels[: plan.composed_levels]]
    binned = [_bin_level(field, exemplar, number) for number, field in enumerate(flat)]
    hidden = energy.make_occluder_layer(compose.compute_cover(levels[0], exemplar, height))
    colour = np.clip(filled - trend.colour, 0, 1).astype(float)
    height = np.nan_to_num(height - trend.height, nan=float(np.nanmean(height)))
    semantic = None if options.kind == "colour" else semantics.make_semantic_layer(colour, options.source)
    seam_energy = energy.SeamEnergy(options.kind, options.slope, energy.make_colour_layer(colour), semantic, hidden)
    guide = patches.make_guidance(colour, height, uncertainty, plan)
    problem = search.SearchProblem(
        plan, guide, seam_energy, options.candidates, options.tries, options.relabel, options.pattern
    )
    found = search.search_patches(problem, options.variants, rng)
    shifts = np.stack([layout.label_shifts(plan, found.places, tile) for tile in range(len(found.labels))])
    soft = poisson_blending.make_soft_maps(colour, height)
    corrections = options.corrected * poisson_blending.solve_corrections(plan, found, shifts, soft)
    recipe = _equalise_heights(Recipe(binned, trend, corrections.astype(np.float32)), found.labels, shifts)
    fields = compose_tiles(recipe, plan, found.labels, shifts)
    report = {
        "places": {name: places.tolist() for name, places in vars(found.places).items()},
        "strip_energy": [strip.seam.energy for strip in found.strips],
        "strip_gamma": [strip.gamma for strip in found.strips],
        "tile_energy": [centre.seam.energy for centre in found.centres],
        "tile_gamma": [centre.gamma for centre in found.centres],
        "layout": plan.to_dict(),
        "texture": scale * exemplar.spacing,
        "energy": options.kind,
        "pattern": options.pattern and options.pattern.describe(),
    }
    means = _average_uncertainty(uncertainty, found.labels, shifts)
    return TileSet(plan.side * exemplar.spacing, exemplar.spacing, fields, found.labels, shifts, means, report, recipe)


def _bin_level(field: GaussianField, exemplar: Exemplar, number: int) -> compose.BinnedLevel:
    """A level by the exemplar's cells; a warning where a cell does not hold one ground disc."""
    level = compose.bin_gaussians(field, exemplar, 2**number)
    if not len(level.field):
        raise InputError(f"level {number}: no Gaussian lies over the exemplar; is its field from another ground.json?")
    held = np.bincount(level.numbers[level.field.ground], minlength=level.cells**2)
    if held.any() and (held != 1).any():
        _log.warning("level %d: %d of %d cells do not hold one ground disc", number, (held != 1).sum(), held.size)
    return level


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


def _equalise_heights(recipe: Recipe, labels: Array, shifts: Array) -> Recipe:
    """Corrections that give all tiles the same mean height at the finest level.

    A rigid shift would tear borders apart, so a tile is raised by A_t bump(x, y) in all its levels alike; A_t makes
    the mean over its finest Gaussians that of all tiles.
    """
    finest = recipe.levels[0]
    count = np.diff(finest.start)
    total = np.bincount(finest.numbers, finest.field.means[:, 2].astype(float), len(count))
    middles = np.arange(labels.shape[1]) + 0.5
    share = compose.bump(np.stack(np.meshgrid(middles, middles), -1).reshape(-1, 2), float(len(middles)))
    means, raises = [], []
    for own, shift, change in zip(labels, shifts, recipe.corrections, strict=True):
        rows, columns = layout.source_cells(own, shift)
        cells = rows * finest.cells + columns
        many = count[cells].sum()
        means.append((total[cells] + count[cells] * change[..., 3]).sum() / many if many else 0.0)
        raises.append((count[cells].ravel() * share).sum() / many if many else 0.0)
    with np.errstate(divide="ignore", invalid="ignore"):
        amounts = np.where(np.array(raises) > 0, (np.mean(means) - np.array(means)) / raises, 0.0)
    raised = recipe.corrections.copy()
    raised[..., 3] += (amounts[:, None] * share).reshape(raised.shape[:3])
    return replace(recipe, corrections=raised)


def compose_tiles(recipe: Recipe, plan: Layout, labels: Array, shifts: Array) -> list[list[GaussianField]]:
    """fields[level][tile] of all levels: those up to a block's of the exemplar, the others of each tile's own cells."""
    spacing, fields = recipe.levels[0].exemplar.spacing, []
    for level in progress(recipe.levels, "compose tiles"):
        tiles = []
        for own, shift, correction in zip(labels, shifts, recipe.corrections, strict=True):
            coarse = compose.coarsen_labels(own, level.cell)
            change = poisson_blending.coarsen_correction(correction, own, coarse)
            tiles.append(compose.compose_tile(level, coarse, shift, change))
        fields.append(tiles)
    for number in range(len(fields), plan.levels):
        cell = 2 ** (number - 1)
        fields.append([compose.merge_cells(tile, plan.side // cell, cell * spacing) for tile in fields[-1]])
    return fields


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
