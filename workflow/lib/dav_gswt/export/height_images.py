"""A height field as images, the northern row first: a PNG of 16 bits, and a TIFF of floats with its place on a map."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import tifffile
from jaxtyping import Float, Float32
from numpy import ndarray as Array
from pyproj import Transformer

from dav_gswt.export.ground_surface import GroundSurface
from dav_gswt.files import atomic_file
from dav_gswt.geometry.georeference import Georeference
from dav_gswt.images import image_files

WHITE = 65535
# tags of GeoTIFF 1.1 (OGC 19-008r4), and GDAL's own for what a pixel's value means
TRANSFORMATION, GEO_KEYS, GDAL_METADATA = 34264, 34735, 42112
MODEL_TYPE, RASTER_TYPE, PROJECTED_CRS, PROJECTED, PIXEL_IS_AREA = 1024, 1025, 3072, 1, 1


@dataclass(frozen=True)
class MapPlace:
    """Where a height field lies on a map: a projected coordinate system, and pixel corners in it.

    Attributes:
        epsg: a zone of UTM on WGS 84.
        matrix: takes (column, row, 1) to easting and northing in metres; pixel (0, 0) covers [0, 1] x [0, 1].
        error: most that the map's projection bends off the matrix within the field, in metres.
        scale, offset: elevation above sea level in metres = scale * height + offset.
    """

    epsg: int
    matrix: Float[Array, "2 3"]
    error: float
    scale: float
    offset: float


def write_height_png(surface: GroundSurface, path: Path | str) -> tuple[float, float]:
    """Write heights, the lowest black and the highest white; returns white's height above black's, and black's."""
    low, high = float(surface.heights.min()), float(surface.heights.max())
    span = max(high - low, 1e-9)
    levels = (surface.heights[::-1].astype(float) - low) * (WHITE / span)
    image_files.write_grey16(path, np.rint(levels).astype(np.uint16))
    return span, low


def place_on_map(surface: GroundSurface, reference: Georeference) -> MapPlace:
    """The place of a height field of a scene that is known on earth."""
    zone = int(np.clip((reference.longitude + 180) // 6 + 1, 1, 60))
    epsg = (32600 if reference.latitude >= 0 else 32700) + zone
    rows, columns = surface.heights.shape
    pixels = np.stack(np.meshgrid(np.linspace(0, columns, 5), np.linspace(0, rows, 5)), -1).reshape(-1, 2)
    x = surface.west + (pixels[:, 0] - 0.5) * surface.step
    y = surface.south + (rows - 0.5 - pixels[:, 1]) * surface.step
    earth = reference.to_earth(np.stack([x, y, np.zeros(len(x))], 1))
    project = Transformer.from_crs("EPSG:4326", f"EPSG:{epsg}", always_xy=True)
    places = np.stack(project.transform(earth[:, 1], earth[:, 0]), 1)
    known = np.concatenate([pixels, np.ones((len(pixels), 1))], 1)
    matrix = np.linalg.lstsq(known, places, rcond=None)[0].T
    error = float(np.linalg.norm(known @ matrix.T - places, axis=1).max())
    return MapPlace(epsg, matrix, error, reference.metres_per_unit, reference.altitude)


def write_height_tiff(heights: Float32[Array, "rows columns"], path: Path | str, place: MapPlace | None) -> None:
    """Write heights of a field, given from south to north, as they are. place: written as GeoTIFF tags."""
    with atomic_file(path) as part:
        tifffile.imwrite(
            part,
            np.ascontiguousarray(heights[::-1], np.float32),
            photometric="minisblack",
            rowsperstrip=64,
            metadata=None,
            software="DAV-GSWT",
            extratags=_geo_tags(place) if place else [],
        )


def _geo_tags(place: MapPlace) -> list[tuple]:
    (a, b, c), (d, e, f) = place.matrix.tolist()
    matrix = [a, b, 0, c, d, e, 0, f, 0, 0, 0, 0, 0, 0, 0, 1]
    keys = {MODEL_TYPE: PROJECTED, RASTER_TYPE: PIXEL_IS_AREA, PROJECTED_CRS: place.epsg}
    flat = [1, 1, 1, len(keys)]
    for key, value in keys.items():
        flat += [key, 0, 1, value]
    items = {"scale": place.scale, "offset": place.offset}
    inner = "".join(f'<Item name="{k.upper()}" sample="0" role="{k}">{v!r}</Item>' for k, v in items.items())
    text = f"<GDALMetadata>{inner}</GDALMetadata>"
    return [
        (TRANSFORMATION, "d", 16, tuple(map(float, matrix)), True),
        (GEO_KEYS, "H", len(flat), tuple(flat), True),
        (GDAL_METADATA, "s", 0, text, True),
    ]
