"""Sparse points for known cameras, triangulated from features.

Features and matches may use several threads, triangulation uses one, so that a run repeats to the bit.
"""

import tempfile
from collections.abc import Mapping
from contextlib import closing
from pathlib import Path

import numpy as np
import pycolmap

from dav_gswt.images import image_files
from dav_gswt.logs import progress
from dav_gswt.photos.sfm.features import enter_camera, enter_image, extract_features, match_photos
from dav_gswt.photos.sfm.registration import NEIGHBOURS, SfmOptions


def triangulate_features(
    known: pycolmap.Reconstruction, sources: Mapping[str, Path], options: SfmOptions
) -> pycolmap.Reconstruction:
    """A model with points where rays through matched SIFT features cross. Poses stay; lenses are shrunk to the size of
    the features.

    known: cameras and images by numbers from 1 on, without points. sources: photos by the images' names.
    """
    # The world is moved to the cameras' mean meanwhile: coordinates of a map projection run to millions.
    middle = np.mean([image.projection_center() for image in known.images.values()], axis=0)
    known.transform(pycolmap.Sim3d(1.0, pycolmap.Rotation3d(), -middle))
    for camera in known.cameras.values():
        camera.rescale(*image_files.fit_size(camera.width, camera.height, options.size))
    with tempfile.TemporaryDirectory(prefix="points-") as scratch:
        folder, database = Path(scratch), Path(scratch) / "database.db"
        images = [image for _, image in sorted(known.images.items())]
        with closing(pycolmap.Database.open(database)) as store:
            numbers = {key: enter_camera(store, camera) for key, camera in sorted(known.cameras.items())}
            for image in images:
                enter_image(store, image.name, *numbers[image.camera_id])
        for image in progress(images, "read photos"):
            photo, camera = image_files.read_photo(sources[image.name]), known.cameras[image.camera_id]
            image_files.write_png(folder / image.name, image_files.shrink_image(photo, camera.width, camera.height))
        extract_features(folder, database, options.size, options.features, options.threads)
        match_photos(len(images), database, NEIGHBOURS, options.threads, options.seed)
        choice = pycolmap.IncrementalPipelineOptions(num_threads=1, random_seed=options.seed)
        choice.triangulation.random_seed = choice.mapper.random_seed = options.seed
        choice.mapper.num_threads = 1
        found = pycolmap.triangulate_points(known, database, folder, folder, options=choice)
    found.transform(pycolmap.Sim3d(1.0, pycolmap.Rotation3d(), middle))
    return found
