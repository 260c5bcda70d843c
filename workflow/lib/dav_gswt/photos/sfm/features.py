"""Features of photos and their matches, in a COLMAP database: the first half of structure from motion."""

import logging
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing
from pathlib import Path
from typing import TypeVar

import pycolmap

from dav_gswt.logs import progress
from dav_gswt.photos.colmap_model import silence_pycolmap
from dav_gswt.photos.sfm.pairs import select_pairs

_log = logging.getLogger(__name__)

# How many photos and pairs COLMAP is given at once. Progress is counted between two batches: while COLMAP writes,
# nothing else may open its database, since a writer that finds it locked aborts the process.
PHOTOS, PAIRS = 16, 200

Item = TypeVar("Item")
Result = TypeVar("Result")


def enter_camera(store: pycolmap.Database, lens: pycolmap.Camera) -> tuple[int, int]:
    """Enter a camera, with a rig of its own. Returns the numbers of camera and rig, which count from 1."""
    lens.camera_id = store.write_camera(lens)
    rig = pycolmap.Rig()
    rig.add_ref_sensor(lens.sensor_id)
    return lens.camera_id, store.write_rig(rig)


def enter_image(store: pycolmap.Database, name: str, camera: int, rig: int) -> pycolmap.Image:
    """Enter an image, with a frame of its own. Its number counts from 1."""
    image = pycolmap.Image(name=name, camera_id=camera)
    image.image_id = store.write_image(image)
    frame = pycolmap.Frame(rig_id=rig)
    frame.add_data_id(image.data_id)
    store.write_frame(frame)
    return image


def extract_features(folder: Path, database: Path, size: int, features: int, threads: int) -> None:
    """Find SIFT features in every photo of the database. features: most of them in a photo."""
    choice = pycolmap.FeatureExtractionOptions(num_threads=threads, use_gpu=False, max_image_size=size)
    choice.sift.max_num_features = features
    with closing(pycolmap.Database.open(database)) as store:
        names = [image.name for image in store.read_all_images()]
    for batch in split_batches(names, PHOTOS, "find features"):
        run_cancellable(
            lambda token, batch=batch: pycolmap.extract_features(
                database,
                folder,
                batch,
                extraction_options=choice,
                device=pycolmap.Device.cpu,
                cancellation_token=token,
            )
        )


def match_photos(count: int, database: Path, neighbours: int, threads: int, seed: int) -> None:
    """Match photos that look alike and keep what one rigid scene explains. neighbours: see `select_pairs`; 0: all."""
    with closing(pycolmap.Database.open(database)) as store:
        names = {image.image_id: image.name for image in store.read_all_images()}
        found = [store.read_descriptors(i).data for i in range(1, count + 1)] if neighbours else []
    if neighbours:
        some = select_pairs(found, neighbours, seed)
    else:
        some = [(i, j) for i in range(count) for j in range(i + 1, count)]
    if len(some) < count * (count - 1) // 2:
        _log.info("match %d of %d pairs of photos: those that look alike", len(some), count * (count - 1) // 2)
    match_image_pairs([(names[i + 1], names[j + 1]) for i, j in some], database, threads, seed)


def match_image_pairs(some: list[tuple[str, str]], database: Path, threads: int, seed: int) -> None:
    """Match the named pairs of the database's images."""
    listed = database.with_name("pairs.txt")
    verification = pycolmap.TwoViewGeometryOptions()
    verification.ransac.random_seed = seed
    for batch in split_batches(some, PAIRS, "match pairs of photos"):
        listed.write_text("".join(f"{one} {two}\n" for one, two in batch), encoding="utf-8")
        run_cancellable(
            lambda token: pycolmap.match_image_pairs(
                database,
                pycolmap.FeatureMatchingOptions(num_threads=threads, use_gpu=False),
                pycolmap.ImportedPairingOptions(match_list_path=listed),
                verification,
                pycolmap.Device.cpu,
                token,
            )
        )


def split_batches(items: Sequence[Item], size: int, what: str) -> Iterator[Sequence[Item]]:
    """Yield the items in batches, and report after each how many are done."""
    with progress(range(len(items)), what) as bar:
        for start in range(0, len(items), size):
            batch = items[start : start + size]
            yield batch
            bar.update(len(batch))


def run_cancellable(work: Callable[[pycolmap.CancellationToken], Result]) -> Result:
    """Run a long call of COLMAP in a thread of its own, so that Ctrl-C can stop it."""
    silence_pycolmap()
    token = pycolmap.CancellationToken()
    with ThreadPoolExecutor(1) as pool:
        job = pool.submit(work, token)
        try:
            return job.result()
        except BaseException:
            token.cancel()
            raise
