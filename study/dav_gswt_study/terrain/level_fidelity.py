"""How well each level stands in for the finest where it takes over: a row a tile and level.

The sixteen tiles lie as a torus, one centre variant at a time, and are seen from the distance from which a level is
used: from 45 degrees and as a walker sees them. Both levels are drawn so large that the finest one's discs are
resolved, and averaged over each pixel of the reference picture: what an eye without aliasing would see. What differs
is then the level's own.
"""

from dataclasses import replace

import numpy as np
from jaxtyping import Float32, Int, UInt8
from numpy import ndarray as Array
from scipy.ndimage import maximum_filter, minimum_filter

from dav_gswt.bundle import manifest
from dav_gswt.field import GaussianField, concatenate_fields, mean_scale
from dav_gswt.geometry import cameras
from dav_gswt.geometry.cameras import Camera
from dav_gswt.images import image_files
from dav_gswt.images.metrics import mse_to_psnr
from dav_gswt.logs import progress
from dav_gswt.raster import make_rasterizer, to_raster_arrays
from dav_gswt.tiles.build import TileSet
from dav_gswt.tiles.layout import EDGES, TORUS, arrange_torus

ELEVATIONS = {"oblique": np.radians(45.0), "walker": np.arcsin(0.1)}  # a walker's eye is at a tenth of the distance
AZIMUTH = np.radians(25.0)  # of the eye: along no row of cells
ROOM = 1.2  # width of the picture over that of the sixteen tiles


def measure_levels(tiles: TileSet, pixels: float, band: float) -> list[dict]:
    """One row a tile and level: mean scale, count, from which distance the level is used, and the errors there.

    Per view `{view}_db`, the PSNR against the finest level, `{view}_change`, the largest difference in 8-bit steps, and
    `{view}_cut_db`, the PSNR over the pixels within one of the level's cells of a cut. None: of the finest level, of
    equal pictures, and of a tile that no pixel looks at.
    Args: pixels, band: see `bundle.build.Options`.
    """
    table = manifest.compute_levels([mean_scale(level) for level in tiles.fields], pixels, band)
    found = []
    for level, fields in enumerate(progress(tiles.fields, "measure levels")):
        distance = (table[level - 1].distance or 0.0) if level else 0.0
        errors = measure_errors(tiles, level, distance) if level else {}
        for tile, field in enumerate(fields):
            row = {"tile": tile, "level": level, "mean_scale": mean_scale([field]), "count": len(field)}
            measures = {
                f"{view}_{key}": errors.get((tile, view), {}).get(key)
                for view in ELEVATIONS
                for key in ("db", "change", "cut_db")
            }
            found.append(row | {"distance": distance} | measures)
    return found


def measure_errors(tiles: TileSet, level: int, distance: float) -> dict[tuple[int, str], dict]:
    """By tile and view: a level's errors against the finest one, seen from a distance."""
    found = {}
    for variant in range(tiles.variants):
        torus = arrange_torus(variant)
        finest, coarse = (join_tiles(tiles.fields[number], torus, tiles.side) for number in (0, level))
        for view, elevation in ELEVATIONS.items():
            camera = _camera(tiles.side, distance, elevation, float(finest.means[:, 2].mean()))
            picture = [render_averaged(field, camera, 2**level) for field in (finest, coarse)]
            tile, cut = _find_tiles(tiles, torus, camera, float(finest.means[:, 2].mean()), 2**level)
            error = picture[1] - picture[0]
            for number in range(EDGES * variant, EDGES * (variant + 1)):
                found[number, view] = _summarize(error[tile == number], cut[tile == number])
    return found


def join_tiles(fields: list[GaussianField], torus: Int[Array, "6 6"], side: float) -> GaussianField:
    """Tiles side by side; the south-western corner of the sixteen is the origin."""
    parts = []
    for (row, column), tile in np.ndenumerate(torus):
        corner = np.array([(column - 1) * side, (row - 1) * side, 0.0], np.float32)
        parts.append(replace(fields[tile], means=fields[tile].means + corner))
    return concatenate_fields(parts)


def render_averaged(field: GaussianField, camera: Camera, factor: int) -> Float32[Array, "h w 3"]:
    """A picture drawn `factor` times as large and averaged. What shines through is not the field's: divided out."""
    large = camera.resized(factor * camera.width, factor * camera.height)
    seen = make_rasterizer(near=1e-6, antialiased=True).forward(**to_raster_arrays(field), camera=large)
    colour = np.clip(seen.colour / np.maximum(seen.alpha, 0.5)[..., None], 0, 1).astype(np.float32)
    return image_files.shrink_image(colour, camera.width, camera.height)


def _camera(side: float, distance: float, elevation: float, height: float) -> Camera:
    """From so far away onto the middle of the sixteen tiles, at the reference picture's focal length."""
    middle = np.array([2 * side, 2 * side, height])
    flat = np.cos(elevation) * np.array([np.cos(AZIMUTH), np.sin(AZIMUTH)])
    width = max(8, int(np.ceil(ROOM * 2**0.5 * len(TORUS) * side * manifest.FOCAL / distance)))
    lower = max(4, int(np.ceil(width * np.sin(elevation))))
    fov = 2 * np.degrees(np.arctan(0.5 * width / manifest.FOCAL))
    return cameras.pinhole(middle + distance * np.array([*flat, np.sin(elevation)]), middle, width, lower, fov)


def _find_tiles(
    tiles: TileSet, torus: Int[Array, "6 6"], camera: Camera, height: float, near: int
) -> tuple[Int[Array, "h w"], UInt8[Array, "h w"]]:
    """Which tile each pixel's ray meets at a height, -1: none of the sixteen; and 1 where that is within `near` cells
    of a cut."""
    origin, step = camera.rays()
    with np.errstate(divide="ignore", invalid="ignore"):
        t = (height - origin[..., 2]) / step[..., 2]
        x, y = (origin[..., i] + t * step[..., i] for i in (0, 1))
        inside = (t > 0) & (np.minimum(x, y) >= 0) & (np.maximum(x, y) < len(TORUS) * tiles.side)
    x, y = np.where(inside, x, 0.0) / tiles.side, np.where(inside, y, 0.0) / tiles.side
    tile = torus[y.astype(int) + 1, x.astype(int) + 1]
    size, n = (1, 2 * near + 1, 2 * near + 1), tiles.labels.shape[1]
    cuts = maximum_filter(tiles.labels, size) != minimum_filter(tiles.labels, size)
    row, column = (np.minimum((v % 1 * n).astype(int), n - 1) for v in (y, x))
    return np.where(inside, tile, -1), (cuts[tile, row, column] & inside).astype(np.uint8)


def _summarize(error: Float32[Array, "n 3"], cut: UInt8[Array, "n"]) -> dict:
    change = float(255 * np.abs(error).max()) if len(error) else None
    return {"db": _decibels(error), "change": change, "cut_db": _decibels(error[cut > 0])}


def _decibels(error: Float32[Array, "n 3"]) -> float | None:
    square = float((error.astype(float) ** 2).mean()) if len(error) else 0.0
    return mse_to_psnr(square)
