"""The ground of a finite terrain for simulators and engines: a collision mesh, height maps, objects' hulls."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array

from dav_gswt.bundle.manifest import Manifest
from dav_gswt.export import height_images, mujoco
from dav_gswt.export.axes import Y_UP, turn_points
from dav_gswt.export.glb import ELEMENT_ARRAY_BUFFER, GlbWriter
from dav_gswt.export.ground_surface import GroundSurface, check_points, choose_steps, collect_surface, measure_tiles
from dav_gswt.export.height_mesh import simplify_heights
from dav_gswt.export.hulls import Hull, collect_hulls
from dav_gswt.export.terrain_area import choose_area, find_metres, find_origin, resolve_lengths
from dav_gswt.files import atomic_folder, write_json
from dav_gswt.geometry.georeference import Georeference
from dav_gswt.terrain.endless import EndlessTerrain
from dav_gswt.terrain.finite import Area, require_plane
from dav_gswt.tiles.build import TileSet

Mesh = tuple[str, Array, Array, dict[str, Any]]  # name, vertices, triangles, extras


def export_ground(
    terrain: EndlessTerrain,
    manifest: Manifest,
    sets: Sequence[TileSet],
    reference: Georeference | None,
    settings: Mapping[str, Any],
    out: Path | str,
) -> None:
    """Write ground.{glb,png,tif,hfield,xml,json} and objects.glb of the area of the config's `export` to a folder.

    Of an area within a radius it is the rectangle about it: a height field has four corners.

    Args:   sets: the tiles of all materials. reference: where the scene lies on earth, if it is known.
    Raises: InputError: a planet, an area whose height field has too many points, metres of a terrain without a scale.
    """
    area = check_ground(terrain, manifest, sets, reference, settings)
    origin = find_origin(terrain, area)
    tiles = measure_tiles(sets, settings["surface"] == "visible")
    surface = collect_surface(terrain, tiles, area)
    points, triangles = simplify_heights(surface.heights, surface.block, settings["mesh_error"] * surface.cell)
    hulls = list(collect_hulls(terrain, area, origin))
    place = height_images.place_on_map(surface, reference) if reference else None
    error = settings["mesh_error"] * surface.cell
    facts = {
        "unit": manifest.unit,
        "cells": {"west": area.west, "south": area.south, "columns": area.columns, "rows": area.rows},
        "origin": origin.tolist(),
        "ground_cell": surface.cell,
        "surface": settings["surface"],
        "mesh": {"error": error, "vertices": len(points), "triangles": len(triangles)},
        "objects": len(hulls),
        "map": None if place is None else {"epsg": place.epsg, "error": place.error, "sea_level_offset": place.offset},
    }
    extras = {key: facts[key] for key in ("unit", "origin", "ground_cell")} | {"error": error}
    with atomic_folder(out) as folder:
        vertices = place_vertices(surface, points, origin)
        write_meshes([("ground", vertices, triangles, extras)], folder / "ground.glb")
        if hulls:
            write_meshes([_as_mesh(hull, manifest.unit) for hull in hulls], folder / "objects.glb")
        facts["heights"] = _write_images(surface, folder, place, origin)
        mujoco.write_hfield(surface, folder / "ground.hfield")
        mujoco.write_model(surface, hulls, origin, "ground.hfield", folder / "ground.xml")
        write_json(folder / "ground.json", facts)


def check_ground(
    terrain: EndlessTerrain,
    manifest: Manifest,
    sets: Sequence[TileSet],
    reference: Georeference | None,
    settings: Mapping[str, Any],
) -> Area:
    """The cells that `export_ground` takes, before any work. Raises: InputError: as there."""
    require_plane(terrain)
    area, _ = choose_area(resolve_lengths(settings, terrain.side, find_metres(manifest, reference)))
    check_points(area, choose_steps(sets))
    return area


def place_vertices(surface: GroundSurface, points: Array, origin: Float[Array, "3"]) -> Float[Array, "v 3"]:
    """Positions of lattice points (row, column) in the frame of an export, z up."""
    row, column = points.T
    x, y = surface.west + column * surface.step, surface.south + row * surface.step
    return np.stack([x, y, surface.heights[row, column]], 1) - origin


def _as_mesh(hull: Hull, unit: str) -> Mesh:
    return hull.name, hull.vertices, hull.triangles, {"unit": unit, "convex": True}


def _write_images(
    surface: GroundSurface, folder: Path, place: height_images.MapPlace | None, origin: Float[Array, "3"]
) -> dict[str, Any]:
    """The height maps; what their pixels mean, as ground.json says it."""
    above = replace(surface, heights=surface.heights - np.float32(origin[2]))
    white, black = height_images.write_height_png(above, folder / "ground.png")
    height_images.write_height_tiff(above.heights, folder / "ground.tif", place)
    rows, columns = surface.heights.shape
    north_west = [surface.west - origin[0], surface.south + (rows - 1) * surface.step - origin[1]]
    return {
        "rows": rows,
        "columns": columns,
        "step": surface.step,
        "north_west": [float(at) for at in north_west],
        "png": {"black": black, "white": black + white, "scale": white / height_images.WHITE, "offset": black},
    }


def write_meshes(meshes: Sequence[Mesh], path: Path | str) -> None:
    """Write triangle meshes of our axes as nodes of a GLB, y up."""
    glb = GlbWriter({"scene": 0, "scenes": [{"nodes": list(range(len(meshes)))}], "nodes": [], "meshes": []})
    for number, (name, vertices, triangles, extras) in enumerate(meshes):
        position = glb.add_array(turn_points(vertices, Y_UP))
        index = glb.add_array(triangles.astype("<u4").ravel(), target=ELEMENT_ARRAY_BUFFER)
        primitive = {"mode": 4, "attributes": {"POSITION": position}, "indices": index}
        glb.document["nodes"].append({"mesh": number, "name": name, "extras": extras})
        glb.document["meshes"].append({"name": name, "primitives": [primitive]})
    glb.write(path)
