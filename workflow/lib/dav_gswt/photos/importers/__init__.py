"""Import of camera models, which take the place of structure from motion.

`import_model` takes a folder of COLMAP, a transforms.json (nerfstudio, instant-ngp) or a
reconstruction.json (OpenSfM, OpenDroneMap), and returns a `Registration`. Positions stay in the
world of the model, unless GPS says where that is. A further format needs a reader that returns an
`ImportedModel`, and a line in `_read_model`.
"""

import logging
import tempfile
from collections import defaultdict
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pycolmap

from dav_gswt.errors import InputError
from dav_gswt.files import read_json
from dav_gswt.images import image_files
from dav_gswt.logs import progress
from dav_gswt.photos.colmap_model import drop_wrong_points, reprojection_errors
from dav_gswt.photos.importers.checks import LARGEST_JSON, ImportedModel, check_size
from dav_gswt.photos.importers.colmap import import_colmap
from dav_gswt.photos.importers.lens_models import QUARTER, camera_key, require_invertible
from dav_gswt.photos.importers.nerfstudio import import_nerfstudio
from dav_gswt.photos.importers.opensfm import import_opensfm
from dav_gswt.photos.importers.photo_matching import MatchedPhoto, PhotoFolder, match_photos_to_images
from dav_gswt.photos.photo_listing import Source
from dav_gswt.photos.recognition import find_colmap_folder
from dav_gswt.photos.sfm.gps import GpsPositions, align_to_gps, read_gps_positions
from dav_gswt.photos.sfm.mapping import LEAST_PHOTOS
from dav_gswt.photos.sfm.registration import (
    NEIGHBOURS,
    Registration,
    SfmOptions,
    replace_lenses,
    triangulate_features,
)

__all__ = ["import_model"]

_log = logging.getLogger(__name__)


def import_model(path: Path | str, folder: Source, options: SfmOptions) -> Registration:
    """The photos of a folder with the cameras of a model.

    A photo belongs to the image of the same name: the path below the folder, else the file name whose last folders
    agree, whatever machine the path is of. No file outside the folder is read. A photo may be a scaled copy. The points
    are those of the model if it says which image sees them. Otherwise they are triangulated from features under the
    given cameras. A model that names no place on earth gets metres and north from GPS positions of its photos, if they
    agree.
    Raises: InputError: not a model, damaged, one that is not read, or fewer than three photos have a camera in it.
    """
    path, photos = Path(path), PhotoFolder(folder)
    given = _read_model(path, photos)
    placed, left_out = match_photos_to_images(given, photos, path)
    if len(placed) < LEAST_PHOTOS:
        raise InputError(
            f"{path}: {len(placed)} of its {len(given.images)} images have a photo in {photos.folder}; at least "
            f"{LEAST_PHOTOS} are needed: give the folder of the photos that the model was made of, under the same names"
        )
    for name, reason in left_out:
        _log.warning("%s is left out: %s", name, reason)
    known, sources = _place_photos(placed, given.points), {place.key: place.path for place in placed}
    if not known.num_points3D():
        known = _find_points(known, sources, options)
    positions = None if given.about else read_gps_positions(list(sources.values()))
    at = dict(zip(sources, positions.at, strict=True)) if positions else {}
    if positions and not align_to_gps(known, at, options.seed, adjust=False):
        positions = None
    model, lenses = replace_lenses(known, {p.key: (p.lens.width, p.lens.height) for p in placed}, options.side)
    for name, camera, lens in zip(model.names, model.cameras, lenses, strict=True):
        require_invertible(lens, camera, f"{path}: {sources[name].name}")
    model = drop_wrong_points(model, np.bincount(model.point_of, minlength=len(model.points)) > 0)
    if not len(model.points):
        raise InputError(
            f"{path}: under its cameras the photos share no point; either they are not those that the model was made "
            "of, or they show too little texture"
        )
    centres = np.stack([camera.centre for camera in model.cameras])
    return Registration(
        model=model,
        sources=tuple(sources[name] for name in model.names),
        lenses=lenses,
        left_out=left_out,
        focal=None,
        error=float(reprojection_errors(model).mean()),
        positions=GpsPositions(given.about, centres) if given.about else positions,
    )


def _read_model(path: Path, photos: PhotoFolder) -> ImportedModel:
    """What a file says, whichever kind it is of."""
    if path.is_dir():
        if model := find_colmap_folder(path):
            return import_colmap(model)
        raise InputError(
            f"{path}: no COLMAP model in this folder (cameras and images, as .bin or .txt); of other programs name the "
            "file itself, transforms.json or reconstruction.json"
        )
    check_size(path, LARGEST_JSON)
    values = read_json(path)
    if isinstance(values, dict) and isinstance(values.get("frames"), list):
        return import_nerfstudio(path, values, photos.stored_size)
    if isinstance(values, list) and values and isinstance(values[0], dict) and "shots" in values[0]:
        return import_opensfm(path, values)
    raise InputError(
        f"{path}: neither a transforms.json (an object with a list `frames`) nor a reconstruction.json (a list of "
        "objects with `shots`); name one of these, or a folder of COLMAP's"
    )


def _place_photos(placed: list[MatchedPhoto], points: pycolmap.Reconstruction) -> pycolmap.Reconstruction:
    """The photos in the model's world, numbered from 1 on, with the points that they see."""
    known, numbers, tracks = pycolmap.Reconstruction(), {}, defaultdict(list)
    for i, place in enumerate(placed, 1):
        if (key := camera_key(place.lens)) not in numbers:
            lens = pycolmap.Camera(place.lens.todict() | {"camera_id": len(numbers) + 1})
            numbers[key] = lens.camera_id
            known.add_camera_with_trivial_rig(lens)
        turn, given = np.linalg.matrix_power(QUARTER, place.turns), place.image
        all_seen = points.images[given.number].get_observation_points2D() if points.num_points3D() else []
        seen = [p for p in all_seen if p.point3D_id in points.points3D]
        # through rays: a photo may be a scaled copy of the model's picture, or turned by EXIF
        rays = given.lens.cam_from_img(np.array([p.xy for p in seen]).reshape(-1, 2))
        pixels = place.lens.img_from_cam(np.c_[rays, np.ones(len(seen))] @ turn.T)
        for k, p in enumerate(seen):
            tracks[p.point3D_id].append(pycolmap.TrackElement(i, k))
        image = pycolmap.Image(name=place.key, keypoints=pixels, camera_id=numbers[key], image_id=i)
        pose = turn @ np.c_[given.rotation, given.translation]
        known.add_image_with_trivial_frame(image, pycolmap.Rigid3d(pose))
    for number, elements in sorted(tracks.items()):
        point = points.points3D[number]
        known.add_point3D(point.xyz, pycolmap.Track(elements), point.color)
    return known


def _find_points(
    known: pycolmap.Reconstruction, sources: Mapping[str, Path], options: SfmOptions
) -> pycolmap.Reconstruction:
    """The model with points from features of its photos; its lenses are shrunk to the size of the features."""
    # The world is moved to the cameras' mean meanwhile: coordinates of a map projection run to millions.
    middle = np.mean([image.projection_center() for image in known.images.values()], axis=0)
    known.transform(pycolmap.Sim3d(1.0, pycolmap.Rotation3d(), -middle))
    for camera in known.cameras.values():
        camera.rescale(*image_files.fit_size(camera.width, camera.height, options.size))
    with tempfile.TemporaryDirectory(prefix="pictures-") as folder:
        for _, image in progress(sorted(known.images.items()), "read photos"):
            photo, camera = image_files.read_photo(sources[image.name]), known.cameras[image.camera_id]
            shrunk = image_files.shrink_image(photo, camera.width, camera.height)
            image_files.write_png(Path(folder) / image.name, shrunk)
        found = triangulate_features(known, Path(folder), NEIGHBOURS, options)
    found.transform(pycolmap.Sim3d(1.0, pycolmap.Rotation3d(), middle))
    return found
