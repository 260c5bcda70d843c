"""Features of photos and their matches, in a COLMAP database: the first half of structure from motion."""

import logging
import subprocess
import sys
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor, wait
from contextlib import closing
from pathlib import Path

import pycolmap

from dav_gswt.logs import progress
from dav_gswt.photos.colmap_model import silence_pycolmap
from dav_gswt.photos.sfm.pairs import select_pairs

_log = logging.getLogger(__name__)

LOOK = 4.0  # seconds between two looks at how far a long step is


def extract_features(count: int, folder: Path, database: Path, size: int, features: int, threads: int) -> None:
    """Find SIFT features in every photo of the database. features: most of them in a photo."""
    choice = pycolmap.FeatureExtractionOptions(num_threads=threads, use_gpu=False, max_image_size=size)
    choice.sift.max_num_features = features
    run_with_progress(
        lambda token: pycolmap.extract_features(
            database, folder, extraction_options=choice, device=pycolmap.Device.cpu, cancellation_token=token
        ),
        lambda: count_rows(database, "keypoints"),
        count,
        "find features",
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
    listed.write_text("".join(f"{one} {two}\n" for one, two in some), encoding="utf-8")
    verification = pycolmap.TwoViewGeometryOptions()
    verification.ransac.random_seed = seed
    run_with_progress(
        lambda token: pycolmap.match_image_pairs(
            database,
            pycolmap.FeatureMatchingOptions(num_threads=threads, use_gpu=False),
            pycolmap.ImportedPairingOptions(match_list_path=listed),
            verification,
            pycolmap.Device.cpu,
            token,
        ),
        lambda: count_rows(database, "two_view_geometries"),
        len(some),
        "match pairs of photos",
    )


def run_with_progress(work: Callable, done: Callable[[], int], total: int, what: str):
    """Do a long piece of work in a thread and report meanwhile how much is done; Ctrl-C stops it."""
    silence_pycolmap()
    token = pycolmap.CancellationToken()
    with ThreadPoolExecutor(1) as pool, progress(None, what, total=total) as bar:
        job = pool.submit(work, token)
        try:
            while wait([job], timeout=LOOK).not_done:
                bar.update(max(0, done() - bar.n))
        except BaseException:
            token.cancel()
            raise
        bar.update(max(0, total - bar.n))
    return job.result()


def count_rows(database: Path, table: str) -> int:
    """Rows of a table that another thread is filling; 0 while it is locked.

    Asked by another process: two copies of SQLite in one process, Python's and pycolmap's, drop each other's locks
    when they close the file, and the writer dies of it.
    """
    ask = "import sqlite3, sys; print(*sqlite3.connect(sys.argv[1], uri=True).execute(sys.argv[2]).fetchone())"
    words = [sys.executable, "-S", "-c", ask, f"file:{database}?mode=ro", f"SELECT COUNT(*) FROM {table}"]
    told = subprocess.run(words, capture_output=True, text=True, check=False).stdout.strip()
    return int(told) if told.isdecimal() else 0
