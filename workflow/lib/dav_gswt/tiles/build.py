"""The tile set of a field: trends out, places searched, strips and centres cut, every level composed."""

import logging
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float, Int, UInt8
from numpy import ndarray as Array
from scipy.ndimage import distance_transform_edt

from dav_gswt.errors import InputError
from dav_gswt.field import SH0, GaussianField
from dav_gswt.lod.levels import AUTO
from dav_gswt.logs import progress
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

_log = logging.getLogger(__name__)

WARN_UNCERTAINTY = 0.5  # mean uncertainty of a tile that is said


@dataclass(frozen=True)
class TilingOptions:
    """share: tile side over the exemplar's. strip: half-width of the strips over the tile's side, below 1/5. Either may
    be layout.AUTO: by the scale of the exemplar's texture. variants: centres per edge colouring. trend: width of the
    low-pass in tile sides. candidates: places that a search compares; tries: of them, how many are cut before the best
    is taken. kind: one of energy.KINDS; slope: of gamma; source: what the semantics are made of. levels: of the tiles,
    a number or layout.AUTO; None: as many as are given. corrected: steps across seams are spread out (`membrane`).
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

    @classmethod
    def from_config(
        cls, tiling: Mapping[str, Any], source: semantics.SemanticSource, levels: int | str | None = None
    ) -> "TilingOptions":
        """The options that an entry of the config's tilings asks for."""
        own = {"share": "tile", "kind": "energy"}
        given = {key: tiling[name] for key in vars(cls()) if (name := own.get(key, key)) in tiling}
        return cls(**given, source=source, levels=levels)


def make_generator(seed: int, tiling: Mapping[str, Any]) -> np.random.Generator:
    """The generator of a tile set, from the workflow's seed and, where it is not 0, the tiling's replicate number."""
    return np.random.default_rng([seed, tiling["replicate"]] if tiling.get("replicate") else [seed])


@dataclass(frozen=True)
class TileSet:
    """16 C tiles at every level, in world units from each tile's south-western corner.

    fields[level][tile]. labels: [tile, y, x], row 0 in the south. shifts: what to add to a cell (x, y) of a tile to
    get the exemplar's cell, per label. uncertainty: mean over each tile's cells. seams: what was chosen and what it
    cost, as JSON.
    """

    side: float
    spacing: float
    fields: list[list[GaussianField]]
    labels: UInt8[Array, "tiles n n"]
    shifts: Int[Array, "tiles 9 2"]
    uncertainty: Float[Array, "tiles"]
    seams: dict

    @property
    def variants(self) -> int:
        return len(self.labels) // EDGES


def cut_tiles(
    levels: list[GaussianField],
    exemplar: Exemplar,
    colour: Float[Array, "m m 3"],
    uncertainty: Float[Array, "m m"],
    options: TilingOptions,
    rng: np.random.Generator,
) -> TileSet:
    """Make the tile set of a field.

    Args:
        levels: finest first; level l's ground has cells of 2^l spacings from the exemplar's corner. Those whose cells
            are wider than a block are left aside: such levels are merged from each tile's own cells.
        colour, uncertainty: seen from straight above, one value a finest cell, **row 0 in the south** (turn a top-down
            camera's picture upside down). Uncertainty in [0, 1]; NaN where nothing is known: a hole takes the colour of
            the nearest cell, and is shown only where nothing better serves.
    Raises: InputError: the exemplar is too small for a tile, a level has no Gaussian in it, or nothing is known of any
        cell.
    """
    shape = (exemplar.cells, exemplar.cells)
    if colour.shape[:2] != shape or uncertainty.shape != shape:
        raise ValueError(f"maps of {colour.shape[:2]} and {uncertainty.shape} cells for an exemplar of {shape}")
    known, doubt = _fill_holes(colour, uncertainty)
    scale = texture.measure_texture_scale(known)
    plan = layout.plan_layout(
        exemplar.cells, options.levels or len(levels), *_choose_sizes(options, scale, exemplar), len(levels)
    )
    _, height = compute_ground_maps(levels[0], exemplar)
    trend = trends.fit_trend(colour, height, exemplar, options.trend * plan.side)
    binned = [
        _check_level(compose.bin_gaussians(trends.remove_trend(field, trend), exemplar, 2**number), number)
        for number, field in enumerate(levels[: plan.composed_levels])
    ]
    stands = energy.make_occluder_layer(occluders.compute_cover(levels[0], exemplar, height))
    colour = np.clip(known - trend.colour, 0, 1).astype(float)
    height = np.nan_to_num(height - trend.height, nan=float(np.nanmean(height)))
    meant = None if options.kind == "colour" else semantics.make_semantic_layer(colour, options.source)
    priced = energy.SeamEnergy(options.kind, options.slope, energy.make_colour_layer(colour), meant, stands)
    guide = patches.make_guidance(colour, height, doubt, plan)
    sketch = search.SearchProblem(plan, guide, priced, options.candidates, options.tries)
    found = search.search_patches(sketch, options.variants, rng)
    labels = found.labels
    shifts = np.stack([layout.label_shifts(plan, found.places, tile) for tile in range(len(labels))])
    corrections = _solve_corrections(plan, found, shifts, poisson_blending.make_soft_maps(colour, height))
    corrections *= options.corrected
    tiles = [
        [_compose_level(level, labels[tile], shifts[tile], corrections[tile]) for level in binned]
        for tile in progress(range(len(labels)), "compose tiles")
    ]
    side = plan.side * exemplar.spacing
    tiles, raised = compose.equalise_heights(tiles, side)
    tiles = [_append_merged_levels(tile, plan, exemplar.spacing) for tile in tiles]
    seams = found.describe() | {
        "layout": {
            key: int(getattr(plan, "composed_levels" if key == "laid" else key))
            for key in ("exemplar", "levels", "laid", "side", "strip", "corner", "block")
        },
        "texture": scale * exemplar.spacing,
        "raised": raised.tolist(),
        "energy": priced.describe(),
        "trend": {"colour": float(np.ptp(trend.colour)), "height": float(np.ptp(trend.height))},
        "correction": np.abs(corrections).max((0, 1, 2)).tolist(),
    }
    shown = [doubt[layout.source_cells(labels[t], shifts[t])].mean() for t in range(len(labels))]
    if max(shown) > WARN_UNCERTAINTY:
        _log.warning(
            "the tiles show ground in doubt (mean uncertainty %.2f to %.2f): a smaller `tile` in the config's seams "
            "would show surer ground, or more photos",
            min(shown),
            max(shown),
        )
    fields = [list(level) for level in zip(*tiles, strict=True)]
    return TileSet(side, exemplar.spacing, fields, labels, shifts, np.array(shown), seams)


def _choose_sizes(options: TilingOptions, scale: float, exemplar: Exemplar) -> tuple[float, float]:
    """What the options ask for as `share` and `strip`, by the texture's scale in cells where that is left to it."""
    by_texture = texture.choose_sizes(scale / exemplar.cells)
    asked = options.share, options.strip
    share, strip = (own if given == AUTO else given for given, own in zip(asked, by_texture, strict=True))
    if AUTO in asked:
        _log.info("texture of scale %.3g: tiles of %.2f of the exemplar", scale * exemplar.spacing, share)
    return share, strip


def _fill_holes(colour: Array, uncertainty: Array) -> tuple[Float[Array, "m m 3"], Float[Array, "m m"]]:
    """Colours where all are known, and uncertainties in [0, 1]; a hole has the nearest cell's colour and is in doubt.

    Raises: InputError: there is nothing but holes, or nothing but ground in doubt.
    """
    known = np.isfinite(colour).all(-1)
    doubt = np.where(known, np.clip(np.nan_to_num(uncertainty, nan=1.0), 0, 1), 1.0).astype(float)
    if not (doubt < 1).any():
        raise InputError(
            "tiles: nothing is known of the exemplar: no photo shows its ground, or all of it is masked; take photos "
            "of it, or leave `masks` out of the scene"
        )
    if not known.all():
        _log.warning("%d of %d cells of the exemplar are holes", (~known).sum(), known.size)
        rows, columns = distance_transform_edt(~known, return_distances=False, return_indices=True)
        colour = colour[rows, columns]
    return colour, doubt


def _solve_corrections(
    plan: Layout, found: search.SearchResult, shifts: Array, ground: poisson_blending.SoftMaps
) -> Float[Array, "t n n 4"]:
    """What every tile's cells are changed by so that no step is left along its seams; the strips' part first."""
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
    out = []
    for tile, (labels, shift) in enumerate(zip(found.labels, shifts, strict=True)):
        out.append(
            poisson_blending.solve_tile(
                labels, shift, poisson_blending.border_values(plan, *strips, tile), plan, ground
            )
        )
    return np.stack(out)


def _compose_level(level: compose.BinnedLevel, labels: Array, shift: Array, correction: Array) -> GaussianField:
    """One tile at one level, corrected; a coarser level follows the finest one's labels by majority."""
    majority = compose.coarsen_labels(labels, level.cell)
    splats = compose.compose_tile(level, majority, shift)
    change = poisson_blending.coarsen_correction(correction, labels, majority)
    return poisson_blending.apply_correction(splats, change, level.cell * level.exemplar.spacing)


def _append_merged_levels(tile: list[GaussianField], plan: Layout, spacing: float) -> list[GaussianField]:
    """A tile's levels with those that are coarser than a block."""
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
