"""The mitsuba scene of a piece of land (meshes, instances, sun and sky), and pictures of it.

The variant is `scalar_rgb`: it runs wherever mitsuba does, instances cost no memory, and with a box filter no pixel is
summed from two blocks, so the bytes do not depend on the number of threads.
"""

from importlib import metadata

import mitsuba as mi
import numpy as np
from jaxtyping import Float32
from numpy import ndarray as Array

from dav_gswt.geometry.cameras import Camera
from dav_gswt.photos.synthetic.land import Land, Light
from dav_gswt.photos.synthetic.meshes import Mesh

VARIANT = "scalar_rgb"
BLOCK = 16  # pixels; fixed, since mitsuba's own choice follows the number of threads and the noise follows the blocks
NEAR = 0.01  # metres: near plane

mi.set_variant(VARIANT)


def describe_renderer() -> dict[str, str | None]:
    """The versions of the renderer, for ground.json."""
    return {"mitsuba": metadata.version("mitsuba"), "variant": VARIANT, "llvm": None}


def render_light(world, camera: Camera, samples: int, seed) -> Float32[Array, "h w 3"]:
    """Linear light of a view. samples: rays a pixel, at least."""
    view = mi.load_dict(make_sensor(camera, {"type": "multijitter", "sample_count": samples}))
    light = mi.render(world, sensor=view, spp=view.sampler().sample_count(), seed=seed)
    return np.array(light, np.float32)[..., :3]


def make_sensor(camera: Camera, sampler: dict) -> dict:
    """The description of a pinhole camera with square pixels for mitsuba.

    mitsuba looks along +z with +x to the *left* of the picture and +y up: COLMAP's axes with x and y turned over. Its
    principal point offset is in widths (heights) of the picture, and grows as the principal point moves left (up).
    """
    pose = np.eye(4)
    pose[:3, :3] = camera.rotation.T * [-1.0, -1.0, 1.0]
    pose[:3, 3] = camera.centre
    return {
        "type": "perspective",
        "fov_axis": "x",
        "fov": float(np.degrees(2 * np.arctan(0.5 * camera.width / camera.fx))),
        "near_clip": NEAR,
        "far_clip": 1e4,
        "principal_point_offset_x": 0.5 - camera.cx / camera.width,
        "principal_point_offset_y": 0.5 - camera.cy / camera.height,
        "to_world": mi.ScalarTransform4f(pose),  # pyright: ignore[reportCallIssue, reportArgumentType]: it takes arrays
        "sampler": sampler,
        "film": {
            "type": "hdrfilm",
            "width": camera.width,
            "height": camera.height,
            "rfilter": {"type": "box"},
            "pixel_format": "rgb",
            "component_format": "float32",
        },
    }


def build_scene(land: Land):
    """The mitsuba scene: every kind of plant is a group of shapes, and every plant an instance of it."""
    light, period = land.light, land.period
    e, a = np.radians([light.elevation, light.azimuth])
    sun = np.array([np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)])
    bare = mi.load_dict({"type": "diffuse", "reflectance": _bitmap(land.albedo, "bilinear")})
    parts = {
        "type": "scene",
        "integrator": {"type": "path", "max_depth": 3, "rr_depth": 10, "block_size": BLOCK},
        "ground": _mesh("ground", land.ground, bare, land.ground.vertices[:, :2] / period),
        "sun": {
            "type": "directional",
            "direction": [-float(v) for v in sun],
            "irradiance": {"type": "rgb", "value": list(light.sun)},
            "sampling_weight": 0.6,
        },
        "sky": _sky(light),
    }
    if land.stones is not None:
        coloured = {"type": "diffuse", "reflectance": {"type": "mesh_attribute", "name": "vertex_color"}}
        parts["stones"] = _mesh("stones", land.stones, mi.load_dict(coloured))
    for k, mesh in enumerate(land.plants):
        parts[f"kind{k}"] = {"type": "shapegroup", "plant": _textured_mesh(f"plant{k}", mesh)}
    for i, (kind, *place) in enumerate(land.places):
        group = {"type": "ref", "id": f"kind{int(kind)}"}
        parts[f"plant{i}"] = {"type": "instance", "group": group, "to_world": _instance_transform(*place)}
    return mi.load_dict(parts)


def _instance_transform(x, y, z, size, yaw, along_x, along_y):
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
    zenith, horizon = np.array(light.zenith), np.array(light.horizon)
    radiance = zenith + (horizon - zenith) * share
    radiance[elevation < 0] = light.below
    image = np.repeat(radiance[:, None], 16, axis=1).astype(np.float32)
    upright = mi.ScalarTransform4f().rotate([1, 0, 0], 90)
    return {"type": "envmap", "bitmap": mi.Bitmap(image), "to_world": upright, "sampling_weight": 0.4}


def _textured_mesh(name: str, mesh: Mesh):
    """A two-sided mesh with one colour per face, stored in a texture with one texel per colour.

    Instances need a texture: mitsuba looks up a vertex attribute by the point in the world, which for an instance is
    not where its mesh is.
    """
    assert mesh.colours is not None, "a plant has colours"
    colours, which = np.unique(mesh.colours, axis=0, return_inverse=True)
    side = int(np.ceil(np.sqrt(len(colours))))
    texels = np.zeros((side * side, 3), np.float32)
    texels[: len(colours)] = colours
    row, column = np.divmod(which.reshape(-1), side)
    coordinates = np.column_stack([(column + 0.5) / side, (row + 0.5) / side])
    texture = _bitmap(texels.reshape(side, side, 3), "nearest")
    bsdf = mi.load_dict({"type": "twosided", "bsdf": {"type": "diffuse", "reflectance": texture}})
    return _mesh(name, mesh, bsdf, coordinates)


def _bitmap(texels, filter_type: str) -> dict:
    bitmap = mi.Bitmap(texels)
    return {"type": "bitmap", "bitmap": bitmap, "raw": True, "wrap_mode": "repeat", "filter_type": filter_type}


def _mesh(name: str, mesh: Mesh, bsdf, coordinates=None):
    """A mitsuba mesh. coordinates: of the texture, per vertex; without them the mesh has vertex colours."""
    props = mi.Properties()
    props["mesh_bsdf"] = bsdf
    props["face_normals"] = not mesh.smooth
    textured = coordinates is not None
    shape = mi.Mesh(name, len(mesh.vertices), len(mesh.faces), props, mesh.smooth, textured)
    if mesh.colours is not None and not textured:
        colours = np.ascontiguousarray(mesh.colours, np.float32).ravel()
        shape.add_attribute("vertex_color", 3, colours)  # pyright: ignore[reportArgumentType]: it takes arrays
    values = mi.traverse(shape)
    values["vertex_positions"] = np.ascontiguousarray(mesh.vertices, np.float32).ravel()
    values["faces"] = np.ascontiguousarray(mesh.faces, np.uint32).ravel()
    if textured:
        values["vertex_texcoords"] = np.ascontiguousarray(coordinates, np.float32).ravel()
    values.update()
    return shape
