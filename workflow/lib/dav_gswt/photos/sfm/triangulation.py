"""Sparse points for known cameras, triangulated from features.

Features and matches may use several threads, triangulation uses one, so that a run repeats to the bit.
"""

import tempfile
from contextlib import closing
from pathlib import Path

import pycolmap

from dav_gswt.photos.sfm.features import enter_camera, enter_image, extract_features, match_photos
from dav_gswt.photos.sfm.registration import SfmOptions


def triangulate_features(
    known: pycolmap.Reconstruction, folder: Path, neighbours: int, options: SfmOptions
) -> pycolmap.Reconstruction:
    """A model with points where rays through matched SIFT features cross. Cameras and poses stay.

    known: cameras and images by numbers from 1 on, without points. folder: of the pictures, by the images' names.
    neighbours: pictures that each is matched with.
    """
    with tempfile.TemporaryDirectory(prefix="points-") as scratch:
        database = Path(scratch) / "database.db"
        with closing(pycolmap.Database.open(database)) as store:
            numbers = {key: enter_camera(store, camera) for key, camera in sorted(known.cameras.items())}
            for _, image in sorted(known.images.items()):
                enter_image(store, image.name, *numbers[image.camera_id])
        extract_features(folder, database, options.size, options.features, options.threads)
        match_photos(known.num_images(), database, neighbours, options.threads, options.seed)
        choice = pycolmap.IncrementalPipelineOptions(num_threads=1, random_seed=options.seed)
        choice.triangulation.random_seed = choice.mapper.random_seed = options.seed
        choice.mapper.num_threads = 1
        return pycolmap.triangulate_points(known, database, folder, scratch, options=choice)
