"""Light and shadow of hills beside a ray tracer: `light.py [OUT.csv]`.

Mitsuba renders the same height field straight from above, of one albedo, below the sun and the sky of `terrain.sun`.
Brightness is divided by the brightness of open level ground and blurred over half a tile. A point is in shadow if it
receives less than half of the sun's beam. Prints a row for each surface and height of the sun.
"""

import csv
import sys
from pathlib import Path

import mitsuba as mi
import numpy as np
from scipy.ndimage import gaussian_filter

from dav_gswt.photos.synthetic import mitsuba_scene  # sets mitsuba's variant
from dav_gswt.terrain.heights import HeightField, HeightMap, Hills, surface_from_config
from dav_gswt.terrain.light import LUMINANCE, Light, Sun, level_light, measure_light, place_light

SIDE, WIDE = 64, 4  # tile sides of the picture, and points of the mesh (pixels) a tile side
ALBEDO, SAMPLES = 0.3, 64
AZIMUTH, ELEVATIONS = 130.0, (15.0, 30.0, 45.0, 60.0, 80.0)
LEAST = 0.002  # share of the picture in shadow, of which an overlap says something


def list_surfaces() -> dict[str, HeightField]:
    """Hills of the default, hills as steep as rock, and terraces with walls."""
    steps = np.random.default_rng(3).normal(size=(256, 256))
    steps = np.floor(3 * gaussian_filter(steps, 10, mode="wrap") / 0.03).clip(-6, 6).astype(np.float32)
    return {
        "default hills": surface_from_config({"kind": "hills", "height": "auto", "wavelength": "auto"}, 1.0, 1.0),
        "steep hills": Hills(24.0, 20.0),
        "terraces": HeightMap(steps, 128.0),
    }


def build_mesh(surface: HeightField, reach: float) -> mi.Mesh:
    """The surface from -reach to reach as a mesh with smooth normals."""
    n = int(2 * reach * WIDE) + 1
    x, y = (v.ravel() for v in np.meshgrid(*2 * [np.linspace(-reach, reach, n)]))
    height, slope = surface.at(x, y)
    normals = np.stack([-slope[:, 0], -slope[:, 1], np.ones(len(x))], 1)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    corner = (np.arange(n - 1) + n * np.arange(n - 1)[:, None]).ravel()
    faces = np.concatenate(
        [np.stack([corner, corner + 1, corner + n], 1), np.stack([corner + 1, corner + n + 1, corner + n], 1)]
    )
    properties = mi.Properties()
    properties["bsdf"] = mi.load_dict({"type": "diffuse", "reflectance": {"type": "rgb", "value": [ALBEDO] * 3}})
    mesh = mi.Mesh("ground", n * n, len(faces), has_vertex_normals=True, props=properties)
    values = mi.traverse(mesh)
    values["vertex_positions"] = np.stack([x, y, height], 1).astype(np.float32).ravel()
    values["vertex_normals"] = normals.astype(np.float32).ravel()
    values["faces"] = faces.astype(np.uint32).ravel()
    values.update()
    return mesh


def trace(mesh: mi.Mesh, sun: Sun, top: float, sky: bool) -> np.ndarray:
    """Linear light from straight above, rows from the south. sky: with the sky and light of ground on ground."""
    pixels = SIDE * WIDE
    direct, diffuse = measure_light(sun.elevation)
    look = mi.ScalarTransform4f().look_at([0, 0, top + 5], [0, 0, 0], [0, 1, 0])
    parts = {
        "type": "scene", "ground": mesh,
        "integrator": {"type": "path", "max_depth": 3 if sky else 2, "block_size": mitsuba_scene.BLOCK},
        "sun": {
            "type": "directional", "direction": (-sun.direction).tolist(),
            "irradiance": {"type": "rgb", "value": direct.tolist()},
        },
        "sensor": {
            "type": "orthographic", "to_world": look @ mi.ScalarTransform4f().scale([SIDE / 2, SIDE / 2, 1]),
            "far_clip": 1e4,
            "sampler": {"type": "multijitter", "sample_count": SAMPLES},
            "film": {"type": "hdrfilm", "width": pixels, "height": pixels, "rfilter": {"type": "box"}},
        },
    }  # fmt: skip
    if sky:
        parts["sky"] = {"type": "constant", "radiance": {"type": "rgb", "value": (diffuse / np.pi).tolist()}}
    picture = np.array(mi.render(mi.load_dict(parts), spp=SAMPLES, seed=0))[..., :3]
    return picture[::-1]


def compare(surface: HeightField, mesh: mi.Mesh, elevation: float) -> dict[str, float]:
    """Compare brightness and shadows of the page's light with the ray tracer's."""
    sun = Sun(elevation, AZIMUTH)
    level = level_light(elevation)
    top = surface.bounds[1]
    traced = trace(mesh, sun, top, True) * np.pi / ALBEDO / level
    beam = (trace(mesh, sun, top, False) * np.pi / ALBEDO / measure_light(elevation)[0]).mean(-1)
    at = (np.arange(SIDE * WIDE) + 0.5) / WIDE - SIDE / 2
    x, y = (v.ravel() for v in np.meshgrid(at, at))
    placed = place_light(Light(sun, sun), surface, 1.0, np.zeros(3))
    own = placed.ground_ratio(x, y).reshape(traced.shape)
    slope = surface.at(x, y)[1]
    cosine = (sun.direction[2] - slope @ sun.direction[:2]) / np.sqrt(1 + (slope**2).sum(1))
    faces = np.maximum(cosine, 0).reshape(beam.shape)
    shade = (beam < 0.5 * faces) | (faces <= 0)
    own_shade = (placed.visible(x, y).reshape(beam.shape) < 0.5) | (faces <= 0)
    smooth, own_smooth = (gaussian_filter(v @ LUMINANCE, 0.5 * WIDE).ravel() for v in (traced, own))
    overlap = (shade & own_shade).sum() / max(1, (shade | own_shade).sum())
    return {
        "correlation": np.corrcoef(smooth, own_smooth)[0, 1],
        "slope": np.polyfit(own_smooth, smooth, 1)[0],
        "shadow": shade.mean(),
        "overlap": overlap if shade.mean() >= LEAST else float("nan"),
        "spread": smooth.std(),
    }


def main(out: str | None) -> None:
    rows = []
    for name, surface in list_surfaces().items():
        mesh = build_mesh(surface, 1.5 * SIDE / 2)
        for elevation in ELEVATIONS:
            rows.append({"surface": name, "elevation": elevation} | compare(surface, mesh, elevation))
            print(
                ", ".join(f"{k} {v:.3f}" if isinstance(v, float) else f"{v}" for k, v in rows[-1].items()), flush=True
            )
    if out:
        with Path(out).open("w", newline="", encoding="utf-8") as file:
            table = csv.DictWriter(file, list(rows[0]), lineterminator="\n")
            table.writeheader()
            table.writerows({k: f"{v:.4g}" if isinstance(v, float) else v for k, v in row.items()} for row in rows)


if __name__ == "__main__":
    main(sys.argv[1] if len(sys.argv) > 1 else None)
