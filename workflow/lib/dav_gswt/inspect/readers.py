"""Readers of artefacts: each returns the scene of one kind of file.

`@reader` names the file names and suffixes that a function opens. Its keyword arguments are the options of the command
line that it accepts. A folder is searched for the names in the order in which the readers are defined.
"""

import inspect
from collections.abc import Callable
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pyvista as pv
from jaxtyping import Float, Int, UInt8
from numpy import ndarray as Array
from scipy import ndimage
from scipy.spatial import KDTree
from scipy.spatial.transform import Rotation
from scipy.special import expit

from dav_gswt.bundle import store as bundles
from dav_gswt.errors import InputError
from dav_gswt.export.splats import TILES_PER_ROW
from dav_gswt.field import GaussianField, read_field
from dav_gswt.inspect.plot import Bar, Scene, to_bytes
from dav_gswt.lod import store as levels
from dav_gswt.reconstruction.ground import Ground
from dav_gswt.tiles import store as tiles
from dav_gswt.tiles.build import TileSet
from dav_gswt.tiles.layout import EDGES, LABELS, arrange_torus

Reader = Callable[..., Scene]
READERS: dict[str, Reader] = {}
MIN_OPACITY = 0.1  # peak opacity below which a Gaussian is left out: solids would hide what lies behind it
FLAT_RATIO = 0.35  # a Gaussian whose least axis is shorter than this share of the middle one is drawn flat
GAP = 0.2  # between two fields or tiles, in their widths
COLOURS = ("colour", "uncertainty")
PATCH_COLOURS = [(187, 187, 187), (68, 119, 170), (238, 102, 119), (34, 136, 51), (204, 187, 68), (102, 204, 238)]
PATCH_COLOURS += [(170, 51, 119), (153, 102, 51), (0, 0, 0)]
CUT_COLOUR, CUT_WIDTH = (255, 214, 10), 0.012  # least width of a cut, in tile sides
HEXAGON = np.stack([np.cos(np.arange(6) * np.pi / 3), np.sin(np.arange(6) * np.pi / 3), np.zeros(6)], -1)
OCTAHEDRON = np.concatenate([np.eye(3), -np.eye(3)])
SIDES = np.array([[0, 1, 2], [1, 3, 2], [3, 4, 2], [4, 0, 2], [1, 0, 5], [3, 1, 5], [4, 3, 5], [0, 4, 5]])
ASPECT, LETTER = 1.6, 0.05  # of all pictures side by side, width over height; height of letters, in picture widths
MAX_PICTURES, MAX_SIDE = 60, 1024  # pictures of a scene, and pixels of a picture's longer side


def reader(*names: str) -> Callable[[Reader], Reader]:
    """Register a reader for file names, or for suffixes such as `.ply`."""

    def register(function: Reader) -> Reader:
        READERS.update(dict.fromkeys(names, function))
        return function

    return register


def read_scene(path: Path, most: int, **given: Any) -> Scene:
    """The scene of an artefact. most: Gaussians or cells that are drawn. given: options, None where not given.

    Raises: InputError: there is no such file, its kind is unknown, or it is damaged.
    """
    from dav_gswt.inspect import camera_readers, map_readers  # noqa: F401 (they register their readers)

    inside = [path / name for name in READERS if (path / name).is_file()]
    file = inside[0] if inside else path
    read = READERS.get(file.name) or READERS.get(file.suffix.lower())
    if not file.exists():
        raise InputError(f"{path}: there is no such file or folder")
    if read is None or not file.is_file():
        raise InputError(f"{path}: not understood; files that are understood: {', '.join(READERS)}")
    known = [name for name in inspect.signature(read).parameters if name not in ("path", "most")]
    given = {name: value for name, value in given.items() if value is not None}
    for name in given.keys() - known:
        accepted = ", ".join(f"--{option}" for option in known) or "no options"
        raise InputError(f"--{name}: means nothing for {path}, which knows {accepted}")
    return read(file, most=most, **given)


@contextmanager
def wrap_errors(path: Path):
    """Turn errors about the content of a file, such as a missing key, into an InputError that names the file."""
    try:
        yield
    except (KeyError, IndexError, TypeError, ValueError, AttributeError) as error:
        why = f"{type(error).__name__}: {error}"
        raise InputError(f"{path}: not as the workflow writes it ({why}); make it again") from error


def find_above(path: Path, name: str, folders: int | None = None) -> Path | None:
    """A file of this name in the nearest folder above a path. folders: how many are searched.

    The files of a fit lie in the folder of its scores or in the one above: `folders` is 2 for them.
    """
    files = (folder / name for folder in path.resolve().parents[:folders])
    return next((file for file in files if file.is_file()), None)


def choose(option: str, value: str | None, names: tuple[str, ...], path: Path) -> str:
    """The value of an option, by default the first of names. Raises: InputError: it is none of names."""
    if value is not None and value not in names:
        raise InputError(f"--{option} {value}: {path} has {', '.join(names[:20])}")
    return value or names[0]


@reader("levels.json")
def read_levels(path: Path, *, most: int, colour: str | None = None, level: int | None = None) -> Scene:
    """All levels of detail side by side, the finest in the west, or one of them."""
    fields = levels.read_levels(path.parent).fields
    return arrange_fields(path, fields, _choose_levels(level, len(fields), path), colour, most)


@reader("field.ply", ".ply")
def read_one_field(path: Path, *, most: int, colour: str | None = None) -> Scene:
    """A field of the workflow, or of another program."""
    return arrange_fields(path, [read_field(path)], None, colour, most)


def _choose_levels(level: int | None, count: int, path: Path) -> list[int]:
    if level is not None and not 0 <= level < count:
        raise InputError(f"--level {level}: {path} has the levels 0 to {count - 1}")
    return list(range(count)) if level is None else [level]


def arrange_fields(
    path: Path, fields: list[GaussianField], numbers: list[int] | None, colour: str | None, most: int
) -> Scene:
    """Fields side by side. numbers: the levels that are shown; None: the fields are no levels."""
    by = choose("colour", colour, COLOURS, path)
    scene = Scene(str(path), [], bars=[Bar("uncertainty")] if by == "uncertainty" else [])
    boxes: list[Array] = []
    for number in numbers or [0]:
        kept = thin_field(fields[number], most // len(numbers or [0]))
        if not len(kept):
            raise InputError(f"{path}: no Gaussian is more opaque than {MIN_OPACITY:g}; there is nothing to draw")
        low, high = np.quantile(kept.means, [0.002, 0.998], axis=0)  # outliers are left out of the first view
        east = boxes[-1][1, 0] + GAP * (high - low)[0] - low[0] if boxes else 0.0
        kept = replace(kept, means=kept.means + np.array([east, 0, 0], np.float32))
        add_solids(scene, kept, compute_colours(kept, by))
        boxes.append(np.array([low, high]) + [east, 0, 0])
        scene.notes.append(
            f"{f'level {number}: ' if numbers else ''}{len(kept)} of {len(fields[number])} Gaussians, by {by}"
        )
    scene.box = np.array([np.min(boxes, 0)[0], np.max(boxes, 0)[1]])
    return scene


def thin_field(field: GaussianField, most: int) -> GaussianField:
    """At most `most` of the Gaussians that are opaque enough to be visible, evenly by their order in the file.

    They are enlarged so that they cover as much.
    """
    visible = field[expit(field.opacity_logits) >= MIN_OPACITY]
    if len(visible) <= most:
        return visible
    kept = visible[np.linspace(0, len(visible) - 1, max(1, most)).astype(int)]
    return replace(kept, log_scales=kept.log_scales + np.float32(0.5 * np.log(len(visible) / len(kept))))


def compute_colours(field: GaussianField, by: str) -> UInt8[Array, "n 3"]:
    """A colour for each Gaussian. by: one of COLOURS."""
    return Bar("").map(field.uncertainty) if by == "uncertainty" else to_bytes(field.base_colours)


def _shade(named: Int[Array, "#n 3"], field: GaussianField) -> UInt8[Array, "n 3"]:
    """Colours of a legend, lighter and darker by each Gaussian's own brightness, so that shapes are visible."""
    grey = np.clip(field.base_colours, 0, 1).mean(1)
    return to_bytes(named / 255 * (1 + 1.5 * (grey - np.median(grey)))[:, None])


def add_solids(scene: Scene, field: GaussianField, colours: UInt8[Array, "n 3"]) -> None:
    """Add Gaussians at one standard deviation.

    A flat one is a hexagon of the ellipse's area, another one an octahedron of the ellipsoid's volume.
    """
    scales = np.exp(field.log_scales.astype(float))
    order = np.argsort(-scales, axis=1, kind="stable")
    scales = np.take_along_axis(scales, order, 1)
    rotations = Rotation.from_quat(field.quats[:, [1, 2, 3, 0]].astype(float)).as_matrix()
    axes = np.take_along_axis(rotations, order[:, None], 2) * scales[:, None]  # columns are the axes, longest first
    flat = field.ground | (scales[:, 2] < FLAT_RATIO * scales[:, 1])
    disc, ball = (np.pi / (1.5 * 3**0.5)) ** 0.5, np.pi ** (1 / 3)  # scales of equal area and volume
    for rows, shape, faces in ((flat, disc * HEXAGON, np.arange(6)[None]), (~flat, ball * OCTAHEDRON, SIDES)):
        points = field.means[rows][:, None] + np.einsum("nij,vj->nvi", axes[rows], shape)
        if len(points):
            cells = (faces + len(shape) * np.arange(len(points))[:, None, None]).reshape(-1, faces.shape[1])
            mesh = pv.PolyData.from_regular_faces(points.reshape(-1, 3).astype(np.float32), cells)
            scene.add(mesh, np.repeat(colours[rows], len(faces), 0))


@reader("seams.json", "labels.npz")
def read_tile_set(path: Path, *, most: int, colour: str | None = None, level: int = 0) -> Scene:
    """A set of tiles with their cuts."""
    seams = path.parents[1] / "seams.json" if path.name == "labels.npz" else path
    with wrap_errors(seams):
        cut = tiles.read_tiles(seams.parent / "tiles", seams)
        shape, wide = cut.labels.shape, cut.labels.shape[1] * cut.spacing
        if shape[1] != shape[2] or cut.labels.max(initial=0) >= len(LABELS) or not abs(wide - cut.side) < 1e-6 * wide:
            raise ValueError("labels.npz is not a map of each tile")
    return _arrange_tiles(seams, cut.fields, cut.side, cut, colour, level, most)


@reader("davgswt.json")
def read_bundle(path: Path, *, most: int, colour: str | None = None, level: int = 0) -> Scene:
    """The quantized tiles of a bundle, without cuts."""
    bundle = bundles.read_bundle(path.parent)
    return _arrange_tiles(path, bundle.fields(), bundle.manifest.tile_side, None, colour, level, most)


def _arrange_tiles(
    path: Path,
    fields: list[list[GaussianField]],
    side: float,
    cut: TileSet | None,
    colour: str | None,
    level: int,
    most: int,
) -> Scene:
    """All tiles of a level, so that neighbours match. cut: the tile set whose cuts are drawn; None: no cuts."""
    by = choose("colour", colour, (*COLOURS, "patch") if cut else COLOURS, path)
    _choose_levels(level, len(fields), path)
    count, step = len(fields[level]), side * (1 + GAP)
    scene = Scene(str(path), [f"{count} tiles, {len(fields)} levels, {side:.4g} wide; level {level} by {by}"])
    scene.viewer, scene.box = (-0.25, -1.0, 1.3), np.zeros((2, 3))
    scene.bars = [Bar("uncertainty")] if by == "uncertainty" else []
    if cut:
        scene.names = dict(zip(LABELS, PATCH_COLOURS, strict=True)) if by == "patch" else {"cut": CUT_COLOUR}
    for tile, corner in place_tiles(count, step):
        field = thin_field(fields[level][tile], most // count)
        if len(field):
            patches = find_patches(field, cut, tile) if cut else np.zeros(len(field), int)
            placed = replace(field, means=field.means + corner.astype(np.float32))
            named = _shade(np.array(PATCH_COLOURS)[patches], field)
            add_solids(scene, placed, named if by == "patch" else compute_colours(field, by))
        if cut and by != "patch":
            scene.add(make_cuts(cut, tile, level).translate(corner, inplace=False), CUT_COLOUR)
        middle = float(np.median(field.means[:, 2])) if len(field) else 0.0
        scene.add_label(f"{tile}", corner + [0.5 * side, -0.6 * GAP * side, middle], 0.1 * side)
        scene.box[1] = np.maximum(scene.box[1], corner + side * np.array([1.0, 1.0, 0.2]))
    return scene


def place_tiles(count: int, step: float) -> list[tuple[int, Float[Array, "3"]]]:
    """Tiles and their south-western corners: each variant's sixteen four by four, neighbours' edges of one colour."""
    return [
        (int(tile), np.array([(TILES_PER_ROW * variant + column) * step, row * step, 0.0]))
        for variant in range(count // EDGES)
        for (row, column), tile in np.ndenumerate(arrange_torus(variant)[1:-1, 1:-1])
    ]


def find_patches(field: GaussianField, cut: TileSet, tile: int) -> Int[Array, "n"]:
    """The label of the cell that each Gaussian lies over; of the nearest cell beyond the tile."""
    last = cut.labels.shape[1] - 1
    column, row = np.clip(field.means[:, :2] / cut.spacing, 0, last).astype(int).T
    return cut.labels[tile][row, column].astype(int)


def make_cuts(cut: TileSet, tile: int, level: int) -> pv.DataSet:
    """The cells where a tile's labels change, a little above the ground, and widened so that they are visible."""
    labels, field = cut.labels[tile], cut.fields[level][tile]
    edge = np.zeros(labels.shape, bool)
    edge[:, 1:] |= labels[:, 1:] != labels[:, :-1]
    edge[1:] |= labels[1:] != labels[:-1]
    edge = ndimage.binary_dilation(edge, iterations=int(CUT_WIDTH * len(labels) / 2)) if len(labels) > 200 else edge
    ground = field.means[field.ground] if field.ground.any() else field.means
    x, y = np.meshgrid(*[(np.arange(len(labels)) + 0.5) * cut.spacing] * 2)
    nearest = KDTree(ground[:, :2]).query(np.stack([x, y], -1))[1]
    heights = ground[nearest, 2].astype(float) + cut.spacing * 2**level
    grid = Ground(0.0, 0.0, cut.spacing, 0, 0, len(labels), heights, edge)
    return make_surface(grid, 1).extract_cells(np.flatnonzero(edge))


def make_surface(grid: Ground, step: int) -> pv.PolyData:
    """A quad for every `step`-th cell in both ways, through heights averaged at the cells' corners."""
    heights, spacing = grid.heights[::step, ::step], grid.spacing * step
    padded = np.pad(heights, 1, mode="edge")
    z = np.nan_to_num(padded[:-1, :-1] + padded[1:, :-1] + padded[:-1, 1:] + padded[1:, 1:]) / 4
    x, y = (np.arange(count + 1) * spacing for count in heights.shape[::-1])
    points = np.stack([*np.meshgrid(grid.west + x, grid.south + y), z], -1).reshape(-1, 3)
    first = (np.arange(len(heights))[:, None] * len(x) + np.arange(len(x) - 1)).ravel()
    cells = first[:, None] + np.array([0, 1, len(x) + 1, len(x)])
    return pv.PolyData.from_regular_faces(points.astype(np.float32), cells)


def outline(west: float, south: float, east: float, north: float) -> pv.PolyData:
    """The border of a level rectangle at height 0."""
    corners = [[west, south, 0.0], [east, south, 0.0], [east, north, 0.0], [west, north, 0.0]]
    return pv.lines_from_points(np.array(corners, np.float32), close=True)
