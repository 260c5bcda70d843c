"""The ground of a finite terrain for simulators and engines: a mesh, a height map, a MuJoCo model, objects' hulls.

Heights are those of the tiles' ground layer seen from above, sampled on a lattice that divides a tile's side into a
power of two, with a point or more a ground cell, and smoothed by SMOOTHING: no photo measures how one disc of the
ground layer lies against its neighbour.

The frame is that of `exports/terrain`, z up. The height map has the northern row first. MuJoCo's height field:
https://mujoco.readthedocs.io/en/stable/XMLreference.html#asset-hfield.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any
from xml.sax.saxutils import quoteattr

import numpy as np
from jaxtyping import Float, Float32
from numpy import ndarray as Array
from scipy.ndimage import distance_transform_edt, gaussian_filter
from scipy.spatial.transform import Rotation
from scipy.special import expit
from trimesh import Scene, Trimesh
from trimesh.convex import convex_hull
from trimesh.creation import icosphere
from trimesh.exchange.gltf import export_glb

from dav_gswt.bundle.manifest import Manifest
from dav_gswt.errors import InputError
from dav_gswt.export.axes import Y_UP, turn_points
from dav_gswt.export.glb import ARRAY_BUFFER, ELEMENT_ARRAY_BUFFER
from dav_gswt.export.height_mesh import simplify_heights
from dav_gswt.export.terrain_files import choose_area, describe_area, find_origin, suggest_size
from dav_gswt.field import GaussianField, concatenate_fields
from dav_gswt.files import atomic_file, atomic_folder, write_json
from dav_gswt.geometry import cameras
from dav_gswt.images import image_files
from dav_gswt.logs import progress
from dav_gswt.raster import render
from dav_gswt.terrain.endless import EndlessTerrain
from dav_gswt.terrain.finite import Area, list_cells, place_feet, require_plane
from dav_gswt.tiles.build import TileSet
from dav_gswt.tiles.layout import EDGES, arrange_torus

MIN_ALPHA = 0.05  # of a lattice point whose height is known; others take their nearest neighbour's
SMOOTHING = 1.0  # standard deviation of what heights are averaged over, in ground cells
AROUND = 0.2  # of the neighbours that are seen beside a tile, as a share of its side
MAX_STEPS = 1024  # of the lattice in a tile's side
MAX_POINTS = 2**25  # of an area's height field
FLAT = 1e-6  # share of an object's size; what is thinner has no hull
SOLID = 0.3  # least opacity of a Gaussian that belongs to a hull
DIRECTIONS = 2  # times that an icosahedron is divided; a hull has the outermost point in the direction of each vertex
WHITE = 65535
MESH_ERROR = 0.25  # ground cells: most that the collision mesh is off the height field
FLOOR = 0.5  # thickness of MuJoCo's ground below the lowest point, in tile sides: nothing thin falls through


@dataclass(frozen=True)
class TileSurfaces:
    """Heights of every tile's ground on a lattice of steps + 1 points a side, borders included.

    Attributes:
        spacing: width of a ground cell, in world units.
        heights: [tile, y, x] from south to north and west to east; tiles as the manifest counts them.
    """

    steps: int
    spacing: float
    heights: Float32[Array, "tiles n n"]


@dataclass(frozen=True)
class GroundSurface:
    """The ground of an area: heights at lattice points, from south to north and from west to east.

    Attributes:
        west, south: world position of the first point.
        step: distance of lattice points, in world units.
        block: lattice steps of a tile's side, a power of two.
        cell: width of a ground cell, in world units.
    """

    west: float
    south: float
    step: float
    block: int
    cell: float
    heights: Float32[Array, "rows columns"]


def measure_tiles(sets: Sequence[TileSet]) -> TileSurfaces:
    """The ground surfaces of the tile sets of all materials: their discs of the ground layer, seen from above.

    A tile without such discs, as those of fields of other programs, is taken whole.
    """
    side, steps = sets[0].side, choose_steps(sets)
    heights = [
        _look_down(_surround(each, tile), side, steps)
        for each in progress(sets, "measure the tiles' ground")
        for tile in range(len(each.fields[0]))
    ]
    return TileSurfaces(steps, min(each.spacing for each in sets), np.stack(heights))


def choose_steps(sets: Sequence[TileSet]) -> int:
    """Steps of the lattice in a tile's side: a point or more a ground cell."""
    spacing = min(each.spacing for each in sets)
    return min(MAX_STEPS, 1 << max(1, int(np.ceil(np.log2(sets[0].side / spacing - 1e-6)))))


def _surround(tiles: TileSet, tile: int) -> GaussianField:
    """The ground of a tile and of neighbours whose borders fit: what is seen at its own border is theirs, too."""
    torus = arrange_torus(tile // EDGES)
    (row,), (column,) = np.nonzero(torus[1:-1, 1:-1] == tile)
    parts = []
    for (north, east), number in np.ndenumerate(torus[row : row + 3, column : column + 3]):
        field, by = tiles.fields[0][number], np.array([east - 1, north - 1, 0]) * tiles.side
        shown = np.ones(len(field), bool) if not field.ground.any() else field.ground
        means = field.means + by
        near = (np.abs(means[:, :2] - 0.5 * tiles.side) < (0.5 + AROUND) * tiles.side).all(1)
        parts.append(replace(field, means=means.astype(np.float32))[shown & near])
    return concatenate_fields(parts)


def _look_down(field: GaussianField, side: float, steps: int) -> Float32[Array, "n n"]:
    """Mean height of what covers each lattice point of a tile, weighted as it is drawn from above."""
    pitch, top = side / steps, float(field.means[:, 2].max()) + side
    camera = cameras.top_down(-0.5 * pitch, -0.5 * pitch, steps + 1, steps + 1, pitch, top)
    seen = render(field, camera)
    known = seen.alpha[::-1] > MIN_ALPHA
    heights = top - seen.depth[::-1] / np.maximum(seen.alpha[::-1], MIN_ALPHA)
    nearest = distance_transform_edt(~known, return_distances=False, return_indices=True)
    return heights[tuple(nearest)].astype(np.float32)


def check_points(area: Area, steps: int) -> None:
    """Raises: InputError: an area's height field would have more than MAX_POINTS points."""
    count = (area.columns * steps + 1) * (area.rows * steps + 1)
    if count > MAX_POINTS:
        size = f"{describe_area(area)} a height field of {count} points"
        raise InputError(f"export: ground: {size}, at most {MAX_POINTS} are written; {suggest_size(count, MAX_POINTS)}")


def collect_surface(terrain: EndlessTerrain, tiles: TileSurfaces, area: Area) -> GroundSurface:
    """The ground of an area as the terrain draws it: in each cell that of the materials which lie there, displaced.

    Where tiles meet, a point of their common border has the mean of their heights. What is smoothed are the tiles, not
    the terrain's surface. Ask `check_points` before.
    """
    n, pitch = tiles.steps, terrain.side / tiles.steps
    total = np.zeros((area.rows * n + 1, area.columns * n + 1), np.float32)
    shared = np.zeros(total.shape, np.float32)
    cells = list_cells(terrain, area)
    columns = (v.tolist() for v in (cells.i, cells.j, cells.tile, cells.materials))
    for i, j, tile, materials in zip(*columns, strict=True):
        part = np.s_[
            (j - area.south) * n : (j - area.south + 1) * n + 1, (i - area.west) * n : (i - area.west + 1) * n + 1
        ]
        total[part] += _choose_heights(terrain, tiles, i, j, tile, materials)
        shared[part] += 1
    heights = gaussian_filter(total / shared, SMOOTHING * tiles.spacing / pitch, mode="nearest", truncate=3)
    x = area.west * terrain.side + np.arange(heights.shape[1]) * pitch
    for row, line in enumerate(heights):  # a line at a time: the surface's own arrays are float64
        y = area.south * terrain.side + row * pitch
        line += terrain.heights.at(x, np.full(len(x), y))[0].astype(np.float32)
    return GroundSurface(area.west * terrain.side, area.south * terrain.side, pitch, n, tiles.spacing, heights)


def _choose_heights(
    terrain: EndlessTerrain, tiles: TileSurfaces, i: int, j: int, tile: int, materials: int
) -> Float32[Array, "n n"]:
    """Heights of a cell's lattice points: of the material that lies at each."""
    if terrain.classes is None or materials & (materials - 1) == 0:
        return tiles.heights[tile]
    numbers = [m for m in range(terrain.classes.materials) if materials >> m & 1]
    each = np.stack([tiles.heights[m * terrain.tiles_each + tile % terrain.tiles_each] for m in numbers])
    y, x = np.mgrid[: tiles.steps + 1, : tiles.steps + 1] * np.float32(terrain.side / tiles.steps)
    points = np.concatenate([np.stack([x, y, z], -1).reshape(-1, 3) for z in each]).astype(np.float32)
    owner = np.repeat(numbers, x.size)
    kept = terrain.classes.keep(i, j, points, owner).reshape(each.shape)
    chosen = np.argmax(kept, axis=0)  # two keep a point only where one rises; the first one is then as good
    return np.take_along_axis(each, chosen[None], axis=0)[0]


def collect_hulls(terrain: EndlessTerrain, area: Area, origin: Float[Array, "3"]) -> Iterator[tuple[str, Trimesh]]:
    """Names and hulls of all objects whose feet lie in an area, in the order of its cells. origin: see `find_origin`.

    An object without any extent in space, as one of a single flat leaf, has none.
    """
    if terrain.scatter is None:
        return
    cells = list_cells(terrain, area)
    found = terrain.scatter.instances_in(cells.i, cells.j)
    feet = place_feet(terrain, found)
    shapes = [find_outermost(levels[0]) for levels in terrain.objects]
    thick = [np.linalg.matrix_rank(each - each.mean(0), FLAT * np.ptp(each)) == 3 for each in shapes]
    names = [each.name for each in terrain.object_entries]
    for k, number in enumerate(found.number.tolist()):
        points = feet[k] + found.size[k] * Rotation.from_euler("z", found.turn[k], degrees=True).apply(shapes[number])
        points[:, 2] += terrain.heights.at(points[:, 0], points[:, 1])[0]
        if thick[number]:
            yield f"{names[number]}_{k}", convex_hull(points - origin)


def find_outermost(field: GaussianField) -> Float[Array, "k 3"]:
    """The outermost points of an object in directions all around: of its ellipsoids of one standard deviation."""
    solid = field[expit(field.opacity_logits.astype(float)) >= SOLID]
    field = solid if len(solid) else field
    axes = Rotation.from_quat(field.quats.astype(float), scalar_first=True).as_matrix()
    axes = axes * np.exp(field.log_scales.astype(float))[:, None]
    means = field.means.astype(float)
    points = []
    for direction in icosphere(DIRECTIONS).vertices:
        along = np.einsum("nij,i->nj", axes, direction)  # how far each axis reaches in the direction
        reach = np.linalg.norm(along, axis=1)
        k = int(np.argmax(means @ direction + reach))
        points.append(means[k] + axes[k] @ along[k] / max(reach[k], 1e-30))
    return np.unique(np.round(points, 9), axis=0)


def export_ground(
    terrain: EndlessTerrain,
    manifest: Manifest,
    sets: Sequence[TileSet],
    settings: Mapping[str, Any],
    out: Path | str,
) -> None:
    """Write ground.{glb,png,hfield,xml,json} and objects.glb of the area of the config's `export` to a folder.

    sets: the tiles of all materials. Raises: InputError: a planet, or an area whose height field has too many points.
    """
    area = check_ground(terrain, sets, settings)
    origin = find_origin(terrain, area)
    surface = collect_surface(terrain, measure_tiles(sets), area)
    error = MESH_ERROR * surface.cell
    points, triangles = simplify_heights(surface.heights, surface.block, error)
    row, column = points.T
    x, y = surface.west + column * surface.step, surface.south + row * surface.step
    vertices = np.stack([x, y, surface.heights[row, column]], 1) - origin
    mesh, hulls = Trimesh(vertices, triangles, process=False), dict(collect_hulls(terrain, area, origin))
    facts = {
        "unit": manifest.unit,
        "cells": vars(area),
        "origin": origin.tolist(),
        "ground_cell": surface.cell,
        "mesh": {"error": error, "vertices": len(points), "triangles": len(triangles)},
        "objects": len(hulls),
    }
    extras = {key: facts[key] for key in ("unit", "origin", "ground_cell")} | {"error": error}
    with atomic_folder(out) as folder:
        write_meshes({"ground": mesh}, extras, folder / "ground.glb")
        if hulls:
            write_meshes(hulls, {"unit": manifest.unit, "convex": True}, folder / "objects.glb")
        facts["heights"] = _write_heights(surface, folder, origin)
        _write_mujoco(surface, hulls, origin, folder)
        write_json(folder / "ground.json", facts)


def check_ground(terrain: EndlessTerrain, sets: Sequence[TileSet], settings: Mapping[str, Any]) -> Area:
    """The cells that `export_ground` takes, before any work. Raises: InputError: as there."""
    require_plane(terrain)
    area = choose_area(settings)
    check_points(area, choose_steps(sets))
    return area


def write_meshes(meshes: Mapping[str, Trimesh], extras: dict[str, Any], path: Path) -> None:
    """Write triangle meshes of our axes as nodes of a GLB, y up. extras: of each node."""
    scene = Scene()
    for name, mesh in meshes.items():
        turned = Trimesh(turn_points(mesh.vertices, Y_UP), mesh.faces, process=False)
        scene.add_geometry(turned, node_name=name, geom_name=name, metadata=extras)
    with atomic_file(path) as part:
        part.write_bytes(export_glb(scene, include_normals=False, tree_postprocessor=_name_targets))


def _name_targets(tree: dict[str, Any]) -> None:
    """Say of each buffer view whether it holds vertices or indices, which glTF's validator asks for."""
    for mesh in tree["meshes"]:
        for primitive in mesh["primitives"]:
            for accessor in primitive["attributes"].values():
                tree["bufferViews"][tree["accessors"][accessor]["bufferView"]]["target"] = ARRAY_BUFFER
            tree["bufferViews"][tree["accessors"][primitive["indices"]]["bufferView"]]["target"] = ELEMENT_ARRAY_BUFFER


def _write_heights(surface: GroundSurface, folder: Path, origin: Float[Array, "3"]) -> dict[str, Any]:
    """Write ground.png, 16 bits from the lowest to the highest point. Returns: what ground.json says of it."""
    above = surface.heights[::-1]
    low, high = float(above.min()), float(above.max())
    span = max(high - low, 1e-9)
    levels = np.rint((above.astype(float) - low) * (WHITE / span)).astype(np.uint16)
    image_files.write_grey16(folder / "ground.png", levels)
    rows, columns = above.shape
    north_west = [surface.west - origin[0], surface.south + (rows - 1) * surface.step - origin[1]]
    return {
        "rows": rows,
        "columns": columns,
        "step": surface.step,
        "north_west": [float(at) for at in north_west],
        "png": {"black": low, "white": low + span, "scale": span / WHITE, "offset": low},
    }


def _write_mujoco(
    surface: GroundSurface, hulls: Mapping[str, Trimesh], origin: Float[Array, "3"], folder: Path
) -> None:
    """Write ground.hfield (rows and columns as int32, heights from south to north) and ground.xml, a model of it."""
    heights = surface.heights
    with atomic_file(folder / "ground.hfield") as part, part.open("wb") as file:
        file.write(np.array(heights.shape, "<i4").tobytes() + np.ascontiguousarray(heights, "<f4").tobytes())
    half = (np.array(heights.shape[::-1]) - 1) * surface.step / 2
    low, high = float(heights.min()), float(heights.max())
    size = [*half.tolist(), max(high - low, 1e-6), FLOOR * surface.block * surface.step]
    middle = [*(np.array([surface.west, surface.south]) + half - origin[:2]).tolist(), low - float(origin[2])]
    assets = [f'    <hfield name="ground" file="ground.hfield" size="{_numbers(size)}"/>']
    geoms = [f'    <geom name="ground" type="hfield" hfield="ground" pos="{_numbers(middle)}"/>']
    for name, hull in hulls.items():
        quoted = quoteattr(name)
        assets.append(f'    <mesh name={quoted} vertex="{_numbers(hull.vertices.ravel().tolist())}"/>')
        geoms.append(f'    <geom name={quoted} type="mesh" mesh={quoted} rgba="0.45 0.42 0.36 1"/>')
    light = '    <light directional="true" pos="0 0 100" dir="0.3 0.2 -1"/>'
    lines = ['<mujoco model="terrain">', "  <asset>", *assets, "  </asset>"]
    lines += ["  <worldbody>", light, *geoms, "  </worldbody>", "</mujoco>", ""]
    with atomic_file(folder / "ground.xml") as part:
        part.write_text("\n".join(lines), encoding="utf-8")


def _numbers(values: Sequence[float]) -> str:
    return " ".join(f"{value:.7g}" for value in values)
