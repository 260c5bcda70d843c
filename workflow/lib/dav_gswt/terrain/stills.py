"""Stills of the endless terrain: rendered tile by tile as the viewer does, over a sky and a far ground.

Gaussians are projected as the viewer does, and alpha-blended in a given order. The rasterizer sorts by depth. To blend
in a given order, each splat becomes a flat Gaussian in the picture plane whose depth is its rank, seen by an
orthographic camera. Its covariance there is the splat's, so every backend can render it.
"""

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float, Float32, Int
from numpy import ndarray as Array

from dav_gswt.bundle.manifest import Manifest, Sky
from dav_gswt.field import GaussianField, Rows
from dav_gswt.geometry import cameras
from dav_gswt.geometry.cameras import Camera
from dav_gswt.raster import Rendering, harmonics, make_rasterizer
from dav_gswt.terrain import visibility
from dav_gswt.terrain.backdrop import Backdrop
from dav_gswt.terrain.choice import Vector
from dav_gswt.terrain.endless import EndlessTerrain
from dav_gswt.terrain.heights import Slope, Sphere, displaced_axes
from dav_gswt.terrain.light import Light, light_of, place_light
from dav_gswt.terrain.placement import group_by_cell, place_cell
from dav_gswt.terrain.planet import frame_at, place_on_sphere, visible_on_sphere, walk_from
from dav_gswt.threads import default_threads

DILATION = 0.3  # square pixels, added to variances by the rasterizer
MARGIN = 0.15  # of the picture's side: beyond it the projection is linearised at this margin
FADE_IN = (1.8, 3.2)  # ratio of depth to its standard deviation over which a Gaussian fades in
RIM2 = 2 * np.log(255.0)  # squared Mahalanobis distance at which an opaque splat ends
THINNEST = 1e-9  # pixels
MAX_GAUSSIANS = 10_000_000  # in one picture
ORBIT = 2.5  # height of `above` over a planet, in its radii: all of it is in view
START = (20.0, 30.0)  # longitude and latitude that places on a sphere count from, in degrees


@dataclass(frozen=True)
class Splats(Rows):
    """Ellipses in pixels: centres, log standard deviations of two axes, angle of the first axis from x."""

    centres: Float32[Array, "n 2"]
    log_scales: Float32[Array, "n 2"]
    angles: Float32[Array, "n"]
    opacity_logits: Float32[Array, "n"]
    colours: Float32[Array, "n 3"]
    depths: Float32[Array, "n"]


EMPTY = Splats(*(np.zeros((0, *width), np.float32) for width in ((2,), (2,), (), (), (3,), ())))


def depth_order(splats: Splats) -> Int[Array, "n"]:
    """Indices of the splats from back to front; of equal depths the later one comes first, as in the rasterizer."""
    return np.argsort(splats.depths, kind="stable")[::-1]


def project(field: GaussianField, slope: Slope, camera: Camera, near: float) -> tuple[Splats, Int[Array, "k"]]:
    """Project Gaussians on a surface of these slopes, in their order; those outside the picture are culled.

    S = (J W A)(J W A)^T with A of `displaced_axes` (EWA); its determinant by Lagrange's identity |p x q|^2. A Gaussian
    whose depth is small against its extent in depth fades out: its linearised splat would cover the picture up to the
    horizon. The viewer does the same.

    Returns: the splats, and the index of each in the field.
    """
    q = np.ascontiguousarray((field.means.astype(float) @ camera.rotation.T + camera.translation).T)
    ahead = np.flatnonzero(q[2] > near)
    field, q = field[ahead], q[:, ahead]
    axes = np.ascontiguousarray(displaced_axes(field, slope[ahead]).transpose(1, 2, 0))  # NumPy is slow along axes of 3
    axes = (camera.rotation @ axes.reshape(3, -1)).reshape(axes.shape)
    x, y = q[0] / q[2], q[1] / q[2]
    bound_x, bound_y = (
        np.clip(slope, -(c + MARGIN * size) / f, (size - c + MARGIN * size) / f)
        for slope, c, f, size in ((x, camera.cx, camera.fx, camera.width), (y, camera.cy, camera.fy, camera.height))
    )
    across = (axes[0] - bound_x * axes[2]) * (camera.fx / q[2])
    along = (axes[1] - bound_y * axes[2]) * (camera.fy / q[2])
    depth = q[2] / np.maximum(np.sqrt(_dot(axes[2], axes[2])), 1e-300)
    share = np.clip((depth - FADE_IN[0]) / (FADE_IN[1] - FADE_IN[0]), 0, 1)
    share = share * share * (3 - 2 * share)
    visible = share > 0
    centres = camera.fx * x + camera.cx, camera.fy * y + camera.cy
    for at, axis, size in zip(centres, (across, along), (camera.width, camera.height), strict=True):
        extent = np.sqrt(RIM2 * (_dot(axis, axis) + DILATION))
        visible &= (at + extent > 0) & (at - extent < size)
    share, logits = share[visible], field.opacity_logits[visible]
    opacity = share / (1 + np.exp(-logits.astype(float)))
    with np.errstate(divide="ignore"):
        faded = np.log(opacity) - np.log1p(-opacity)
    log_scales, angles = _ellipses(across[:, visible], along[:, visible])
    splats = Splats(
        np.stack([at[visible] for at in centres], 1).astype(np.float32),
        log_scales,
        angles,
        np.where(share == 1, logits, faded).astype(np.float32),
        harmonics.seen_colours(field.sh[visible], field.means[visible].astype(float), camera),
        q[2, visible].astype(np.float32),
    )
    return splats, ahead[visible]


def _dot(one: Float[Array, "3 n"], other: Float[Array, "3 n"]) -> Float[Array, "n"]:
    return one[0] * other[0] + one[1] * other[1] + one[2] * other[2]


def blend(splats: Splats, camera: Camera) -> Rendering:
    """Alpha-blend splats that are given back to front; the `depth` of the rendering is their rank."""
    n = len(splats)
    flat = Camera(np.eye(3), np.zeros(3), 1.0, 1.0, 0.0, 0.0, camera.width, camera.height, True)
    rank = np.arange(n, 0, -1, dtype=np.float32)
    return make_rasterizer(dilation=DILATION).forward(
        np.concatenate([splats.centres, rank[:, None]], 1),
        np.concatenate([splats.log_scales, np.full((n, 1), np.log(THINNEST), np.float32)], 1),
        np.stack([np.cos(splats.angles / 2), *np.zeros((2, n)), np.sin(splats.angles / 2)], 1).astype(np.float32),
        splats.opacity_logits,
        splats.colours,
        flat,
    )


def _ellipses(across: Float[Array, "3 n"], along: Float[Array, "3 n"]):
    """Log standard deviations along the two axes of S, and the angle of the first."""
    a, b, c = _dot(across, across), _dot(across, along), _dot(along, along)
    major = 0.5 * (a + c) + np.hypot(0.5 * (a - c), b)
    (p, q, r), (u, v, w) = across, along
    area = (q * w - r * v) ** 2 + (r * u - p * w) ** 2 + (p * v - q * u) ** 2
    minor = area / np.maximum(major, THINNEST**2)
    variances = np.maximum(np.stack([major, minor], 1), THINNEST**2)
    return (0.5 * np.log(variances)).astype(np.float32), (0.5 * np.arctan2(2 * b, a - c)).astype(np.float32)


@dataclass(frozen=True)
class Shot:
    """Viewpoint of a still: position in tiles, height above the surface in eye floors, viewing direction."""

    name: str
    at: tuple[float, float]  # tiles
    height: float  # eye floors
    pitch: float  # degrees below the horizon
    yaw: float  # degrees from east


SHOTS = (
    Shot("walker", (0.5, 0.5), 1.0, 12.0, 60.0),
    Shot("oblique", (3.3, 2.2), 3.0, 35.0, 20.0),
    Shot("above", (-4.0, 5.0), 12.0, 90.0, 90.0),
)


def list_shots(terrain: EndlessTerrain, floor: float) -> list[Shot]:
    """The stills of a terrain; on a sphere `above` is the view from an orbit. floor: lowest height of the eye."""
    if not isinstance(terrain.heights, Sphere):
        return list(SHOTS)
    high = ORBIT * terrain.heights.radius / floor
    return [replace(shot, height=high) if shot.pitch == 90 else shot for shot in SHOTS]


def shot_camera(shot: Shot, terrain: EndlessTerrain, floor: float, width: int, height: int) -> Camera:
    """The camera of a shot, with a horizontal field of view of 60 degrees. floor: lowest height of the eye."""
    if isinstance(sphere := terrain.heights, Sphere):
        axes = walk_from(frame_at(*START), np.array(shot.at) * terrain.side, sphere.radius)
        eye = (sphere.radius + shot.height * floor) * axes[2]
        return camera_on(eye, axes, shot.yaw, -min(shot.pitch, 89.99), width, height)
    x, y = (v * terrain.side for v in shot.at)
    ground, _ = terrain.heights.at(np.array([x]), np.array([y]))
    eye = np.array([x, y, ground[0] + shot.height * floor])
    down, yaw = np.radians(min(shot.pitch, 89.99)), np.radians(shot.yaw)
    ahead = np.array([np.cos(down) * np.cos(yaw), np.cos(down) * np.sin(yaw), -np.sin(down)])
    return cameras.pinhole(eye, eye + ahead, width, height, 60.0)


def camera_on(eye: Vector, axes: Float[Array, "3 3"], yaw: float, pitch: float, width: int, height: int) -> Camera:
    """The camera of an eye with a horizontal field of view of 60 degrees.

    Args:   axes: east, north and up. yaw: degrees from east to the left. pitch: degrees above the level, over -90.
    """
    up, turn = np.radians(pitch), np.radians(yaw)
    ahead = np.array([np.cos(up) * np.cos(turn), np.cos(up) * np.sin(turn), np.sin(up)])
    here = cameras.pinhole(np.zeros(3), ahead, width, height, 60.0)
    rotation = here.rotation @ axes
    return replace(here, rotation=rotation, translation=-rotation @ eye)


def render_shot(
    terrain: EndlessTerrain, shot: Shot, manifest: Manifest, width: int, height: int
) -> Float32[Array, "h w 3"]:
    """Render a shot with the eye floor, sky and ground colour of the bundle's manifest."""
    camera = shot_camera(shot, terrain, manifest.eye_floor, width, height)
    return render_view(terrain, camera, manifest.sky, manifest.ground_colour, light=light_of(manifest))


def render_view(
    terrain: EndlessTerrain,
    camera: Camera,
    sky: Sky,
    ground_colour: Sequence[float] | Array,
    exact: bool = False,
    light: Light | None = None,
) -> Float32[Array, "h w 3"]:
    """Render the terrain; pixels that no tile covers show the sky above the horizon and the far ground below it.

    Tiles are drawn back to front, each in a pre-sorted order; the 3 x 3 block about the eye is drawn last and sorted by
    depth.

    Args:   exact: sort all Gaussians together by depth, as a reference. light: of sun and sky; None: as captured.
    Raises: ValueError: an orthographic camera, whose rays have no common origin.
    """
    if camera.orthographic:
        raise ValueError("the terrain is drawn for a pinhole camera")
    eye, here, surface = camera.centre, replace(camera, translation=np.zeros(3)), terrain.heights
    if light and not isinstance(surface, Sphere):
        terrain = replace(terrain, light=place_light(light, surface, terrain.side, eye))
    sphere = surface if isinstance(surface, Sphere) else None
    cells = visible_on_sphere(terrain, sphere, camera) if sphere else visibility.visible_cells(terrain, camera)
    terrain = visibility.coarsen_to_budget(terrain, camera, MAX_GAUSSIANS, cells)
    things = group_by_cell(terrain, cells, eye)
    backdrop = Backdrop.for_eye(terrain, eye, sky, ground_colour)

    def project_cell(k: int) -> Splats:
        if sphere:
            field, slope = place_on_sphere(terrain, sphere, cells[k : k + 1], eye)
        else:
            field, slope = place_cell(terrain, cells[k : k + 1], eye, things.get(k))
        return project(backdrop.blend_far(field, slope), slope, here, terrain.near)[0]

    far, close = [EMPTY], [EMPTY]
    with ThreadPoolExecutor(default_threads()) as pool:  # NumPy works beside itself; each cell is on its own
        for k, part in enumerate(pool.map(project_cell, range(len(cells)))):
            (close if exact or cells.close[k] else far).append(part)
    last = Splats.concatenate(close)
    seen = blend(Splats.concatenate([*far, last[depth_order(last)]]), here)
    return np.clip(seen.colour + (1 - seen.alpha)[..., None] * backdrop.show(here.rays()[1]), 0, 1)
