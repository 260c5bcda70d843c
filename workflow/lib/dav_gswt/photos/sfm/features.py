"""Features of photos, the pairs that look alike, and their matches, in a COLMAP database."""

import logging
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing
from pathlib import Path
from typing import TypeVar

import numpy as np
import pycolmap
from jaxtyping import Float, Float32, UInt8
from numpy import ndarray as Array
from scipy.cluster.vq import kmeans2, vq
from scipy.sparse.csgraph import minimum_spanning_tree

from dav_gswt.logs import progress

_log = logging.getLogger(__name__)

# How many photos and pairs COLMAP is given at once. Progress is counted between two batches: while COLMAP writes,
# nothing else may open its database, since a writer that finds it locked aborts the process.
PHOTOS, PAIRS = 16, 200

WORDS = 48
SAMPLE = 20_000  # features that the vocabulary is learned from
EACH = 1200  # features of a photo that describe it
NEXT = 2  # photos before and after a photo by name: flights are named in their order
ALL = 20  # photos up to which every pair is matched

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
    """Match photos that look alike and keep what one rigid scene explains. neighbours: see `select_pairs`."""
    with closing(pycolmap.Database.open(database)) as store:
        names = {image.image_id: image.name for image in store.read_all_images()}
        found = [store.read_descriptors(i).data for i in range(1, count + 1)]
    some = select_pairs(found, neighbours, seed)
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


def split_batches(items: list, size: int, what: str) -> Iterator[list]:
    """Yield the items in batches, and report after each how many are done."""
    with progress(range(len(items)), what) as bar:
        for start in range(0, len(items), size):
            batch = items[start : start + size]
            yield batch
            bar.update(len(batch))


def run_cancellable(work: Callable[[pycolmap.CancellationToken], Result]) -> Result:
    """Run a long call of COLMAP in a thread of its own, so that Ctrl-C can stop it."""
    token = pycolmap.CancellationToken()
    with ThreadPoolExecutor(1) as pool:
        job = pool.submit(work, token)
        try:
            return job.result()
        except BaseException:
            token.cancel()
            raise


def select_pairs(descriptors: list[UInt8[Array, "_ 128"]], neighbours: int, seed: int) -> list[tuple[int, int]]:
    """Pairs i < j of photos to match. neighbours: of each photo; every pair is taken if there are
    few photos.

    A photo is matched with those whose descriptors are most similar, with those before and after it
    by name, and along a spanning tree of all photos.
    """
    count = len(descriptors)
    if count <= ALL or neighbours >= count - 1:
        return [(i, j) for i in range(count) for j in range(i + 1, count)]
    alike = compare_descriptions(describe_photos(descriptors, seed))
    pairs = {(i, i + step) for step in range(1, NEXT + 1) for i in range(count - step)}
    for i in range(count):
        order = np.argsort(-alike[i], kind="stable")
        near = [int(j) for j in order if j != i][:neighbours]
        pairs |= {(min(i, j), max(i, j)) for j in near}
    tree = minimum_spanning_tree(np.triu(2.0 - alike, 1)).tocoo()  # positive, so that no edge counts as missing
    return sorted(pairs | {(min(i, j), max(i, j)) for i, j in zip(tree.row.tolist(), tree.col.tolist(), strict=True)})


def describe_photos(descriptors: list[UInt8[Array, "_ 128"]], seed: int) -> Float32[Array, "photos d"]:
    """A global descriptor for each photo: a unit vector, or zero for a photo without features.

    It is VLAD of the SIFT features over a small vocabulary learned from the set itself (Jegou et
    al. 2010, with RootSIFT and intra-normalisation: Arandjelovic and Zisserman 2013), so that
    nothing is downloaded.
    """
    rng = np.random.default_rng(seed)
    some = []
    for rows in descriptors:
        if len(rows) > EACH:
            rows = rows[np.linspace(0, len(rows) - 1, EACH).astype(int)]
        f = rows.astype(np.float32)
        some.append(np.sqrt(f / np.maximum(f.sum(1, keepdims=True), 1e-12)))  # RootSIFT: distances are Hellinger's
    pooled = np.concatenate(some)
    if len(pooled) < WORDS:
        return np.zeros((len(some), WORDS * 128), np.float32)
    sample = pooled[rng.choice(len(pooled), min(SAMPLE, len(pooled)), replace=False)]
    words, _ = kmeans2(sample, WORDS, minit="++", rng=np.random.default_rng(seed))
    return np.stack([_aggregate_features(photo, words) for photo in some])


def compare_descriptions(described: Float32[Array, "photos d"]) -> Float[Array, "photos photos"]:
    """Cosines, -1 to 1."""
    return np.clip(described.astype(float) @ described.T.astype(float), -1, 1)


def _aggregate_features(features: Float32[Array, "n 128"], words: Float[Array, "w 128"]) -> Float32[Array, "d"]:
    """Per word the sum of what its features differ from it, each word's of length 1, and the whole."""
    out = np.zeros((len(words), 128))
    if len(features):
        which, _ = vq(features, words)
        np.add.at(out, which, features - words[which])
    out /= np.maximum(np.linalg.norm(out, axis=1, keepdims=True), 1e-12)
    return (out / max(np.linalg.norm(out), 1e-12)).ravel().astype(np.float32)
