"""The ground of a finite terrain for simulators and engines: a mesh, a height map, a MuJoCo model, objects' hulls.

The frame is that of `exports/terrain`, z up. The height map has the northern row first. MuJoCo's height field:
https://mujoco.readthedocs.io/en/stable/XMLreference.html#asset-hfield.
"""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any
from xml.sax.saxutils import quoteattr

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array
from trimesh import Scene, Trimesh
from trimesh.exchange.gltf import export_glb

from dav_gswt.bundle.manifest import Manifest
from dav_gswt.export.axes import Y_UP, turn_points
from dav_gswt.export.glb import ARRAY_BUFFER, ELEMENT_ARRAY_BUFFER
from dav_gswt.export.ground_surface import (
    GroundSurface,
    check_points,
    choose_steps,
    collect_hulls,
    collect_surface,
    measure_tiles,
)
from dav_gswt.export.height_mesh import simplify_heights
from dav_gswt.export.terrain_files import choose_area, find_origin
from dav_gswt.files import atomic_file, atomic_folder, write_json
from dav_gswt.images import image_files
from dav_gswt.terrain.endless import EndlessTerrain
from dav_gswt.terrain.finite import Area, require_plane
from dav_gswt.tiles.build import TileSet

WHITE = 65535
MESH_ERROR = 0.25  # ground cells: most that the collision mesh is off the height field
FLOOR = 0.5  # thickness of MuJoCo's ground below the lowest point, in tile sides: nothing thin falls through


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
