"""The mitsuba scene of a piece of land: meshes, instances, sun and sky. The caller sets the variant (`renderer`).

Compiled variants trace their kernel through every instance, again for each picture (1600 instances: 100 s), so there
all plants of a kind are one mesh. They also sum the rays of a pixel in no fixed order.
"""

from dataclasses import replace

import mitsuba as mi
import numpy as np
from jaxtyping import Float, Float32
from numpy import ndarray as Array

from dav_gswt.photos.synthetic.land import Land, Light
from dav_gswt.photos.synthetic.meshes import Mesh

BLOCK = 16  # pixels; fixed, since mitsuba's own choice follows the number of threads and the noise follows the blocks


def build_scene(land: Land):
    """The mitsuba scene."""
    bare = mi.load_dict({"type": "diffuse", "reflectance": _bitmap(land.albedo, "bilinear")})
    coloured = mi.load_dict({"type": "diffuse", "reflectance": {"type": "mesh_attribute", "name": "vertex_color"}})
    parts = {
        "type": "scene",
        "integrator": {"type": "path", "max_depth": 3, "rr_depth": 10, "block_size": BLOCK},
        "ground": _mesh("ground", land.ground, bare, land.ground.vertices[:, :2] / land.period),
        "sun": {
            "type": "directional",
            "direction": [-float(v) for v in _unit_vector(land.light.elevation, land.light.azimuth)],
            "irradiance": {"type": "rgb", "value": land.light.sun.tolist()},
            "sampling_weight": 0.6,
        },
        "sky": _sky(land.light),
    }
    if land.stones is not None:
        parts["stones"] = _mesh("stones", land.stones, coloured)
    return mi.load_dict(parts | (_merge_plants(land) if _is_compiled() else _instance_plants(land)))


def isolate_shapes(world) -> dict:
    """The ground and the stones of a scene, if there are any, each as a scene without light."""
    found = {shape.id(): shape for shape in world.shapes() if shape.id() in ("ground", "stones")}
    return {name: mi.load_dict({"type": "scene", name: shape}) for name, shape in found.items()}


def build_objects(land: Land):
    """The plants that are single objects (`labels`), as a scene without light; None: there are none."""
    if land.labels is None:
        return None
    alone = replace(land, places=land.places[np.isin(land.places[:, 0], list(land.labels.plants))])
    if not len(alone.places):
        return None
    return mi.load_dict({"type": "scene"} | (_merge_plants(alone) if _is_compiled() else _instance_plants(alone)))


def _is_compiled() -> bool:
    return not str(mi.variant()).startswith("scalar")


def _instance_plants(land: Land) -> dict:
    """Every kind of plant as a group of shapes, and an instance of it per plant."""
    kinds = {
        f"kind{k}": {"type": "shapegroup", "plant": _textured_mesh(f"plant{k}", mesh)}
        for k, mesh in enumerate(land.plants)
    }
    found = {}
    for i, (kind, *place) in enumerate(land.places):
        group = {"type": "ref", "id": f"kind{int(kind)}"}
        found[f"plant{i}"] = {"type": "instance", "group": group, "to_world": instance_transform(*place)}
    return kinds | found


def _merge_plants(land: Land) -> dict:
    """All plants of a kind as one mesh."""
    found = {}
    for k, mesh in enumerate(land.plants):
        places = land.places[land.places[:, 0] == k][:, 1:]
        if len(places):
            first = len(mesh.vertices) * np.arange(len(places))[:, None, None]
            faces = (np.asarray(mesh.faces) + first).reshape(-1, 3)
            colours = np.tile(_require_colours(mesh), (len(places), 1))
            merged = Mesh(transform_copies(mesh, places), faces, colours, mesh.smooth)
            found[f"plants{k}"] = _textured_mesh(f"plants{k}", merged)
    return found


def transform_copies(mesh: Mesh, places: Float[Array, "n 7"]) -> Float32[Array, "nv 3"]:
    """The vertices of the copies of a plant, one copy after the other, transformed as by `instance_transform`."""
    x, y, z, size, yaw, along_x, along_y = (column[:, None] for column in np.asarray(places, float).T)
    vx, vy, vz = np.asarray(mesh.vertices, float).T
    right, up = size * np.cos(yaw), size * np.sin(yaw)
    turned_x, turned_y = right * vx - up * vy, up * vx + right * vy
    out = np.empty((len(places), len(vx), 3), np.float32)
    out[..., 0], out[..., 1] = turned_x + x, turned_y + y
    out[..., 2] = size * vz + along_x * turned_x + along_y * turned_y + z
    return out.reshape(-1, 3)


def instance_transform(x, y, z, size, yaw, along_x, along_y):
    """The transform of an instance: scale, turn, shear upwards by the slope of the ground, translate."""
    transform = mi.ScalarTransform4f().rotate([0, 0, 1], float(np.degrees(yaw))).scale(float(size))
    if along_x or along_y:
        shear = mi.ScalarTransform4f([[1, 0, 0, 0], [0, 1, 0, 0], [along_x, along_y, 1, 0], [0, 0, 0, 1]])
        transform = shear @ transform
    return mi.ScalarTransform4f().translate([x, y, z]) @ transform


def _sky(light: Light) -> dict:
    """A sky that brightens towards the horizon, as a small environment map; below is the light of far ground."""
    rows = 33
    elevation = np.radians(90.0 - (np.arange(rows) + 0.5) / rows * 180.0)
    share = np.clip(1.0 - np.sin(np.maximum(elevation, 0)), 0, 1)[:, None] ** 2.5
    radiance = light.zenith + (light.horizon - light.zenith) * share
    radiance[elevation < 0] = light.below
    image = np.repeat(radiance[:, None], 16, axis=1).astype(np.float32)
    upright = mi.ScalarTransform4f().rotate([1, 0, 0], 90)
    return {"type": "envmap", "bitmap": mi.Bitmap(image), "to_world": upright, "sampling_weight": 0.4}


def _require_colours(mesh: Mesh) -> Float32[Array, "v 3"]:
    if mesh.colours is None:
        raise ValueError("a mesh without colours needs a texture")
    return mesh.colours


def _textured_mesh(name: str, mesh: Mesh):
    """A two-sided mesh with one colour per face, stored in a texture with one texel per colour.

    Instances need a texture: mitsuba looks up a vertex attribute by the point in the world, which for an instance is
    not where its mesh is.
    """
    colours, which = np.unique(_require_colours(mesh), axis=0, return_inverse=True)
    side = int(np.ceil(np.sqrt(len(colours))))
    texels = np.zeros((side * side, 3), np.float32)
    texels[: len(colours)] = colours
    row, column = np.divmod(which.reshape(-1), side)
    coordinates = np.column_stack([(column + 0.5) / side, (row + 0.5) / side])
    texture = _bitmap(texels.reshape(side, side, 3), "nearest")
    bsdf = mi.load_dict({"type": "twosided", "bsdf": {"type": "diffuse", "reflectance": texture}})
    return _mesh(name, mesh, bsdf, coordinates)


def _bitmap(texels, filter_type: str) -> dict:
    return {
        "type": "bitmap",
        "bitmap": mi.Bitmap(texels),
        "raw": True,
        "wrap_mode": "repeat",
        "filter_type": filter_type,
    }


def _mesh(name: str, mesh: Mesh, bsdf, coordinates=None):
    """A mitsuba mesh. coordinates: of the texture, per vertex; without them the mesh has vertex colours."""
    props = mi.Properties()
    props["mesh_bsdf"] = bsdf
    props["face_normals"] = not mesh.smooth
    textured = coordinates is not None
    shape = mi.Mesh(name, len(mesh.vertices), len(mesh.faces), props, mesh.smooth, textured)
    if not textured:
        colours = np.ascontiguousarray(_require_colours(mesh), np.float32).ravel()
        shape.add_attribute("vertex_color", 3, colours)  # pyright: ignore[reportArgumentType]: it takes arrays
    values = mi.traverse(shape)
    values["vertex_positions"] = np.ascontiguousarray(mesh.vertices, np.float32).ravel()
    values["faces"] = np.ascontiguousarray(mesh.faces, np.uint32).ravel()
    if textured:
        values["vertex_texcoords"] = np.ascontiguousarray(coordinates, np.float32).ravel()
    values.update()
    return shape


def _unit_vector(elevation: float, azimuth: float):
    e, a = np.radians(elevation), np.radians(azimuth)
    return np.array([np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)])
