"""A synthetic page that is served for a while. Running this module does nothing."""

import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from fixtures import bundles
from fixtures.browser import served
from fixtures.page_visit import VIEWER

from dav_gswt.terrain.page import write_page


@contextmanager
def page_of(ground: bundles.Ground) -> Iterator[str]:
    """Its address; prints how large it is."""
    with tempfile.TemporaryDirectory() as folder:
        bundle, page = Path(folder) / "bundle", Path(folder) / "page"
        manifest = bundles.write_bundle(bundle, ground)
        start = time.perf_counter()
        write_page(bundle, VIEWER, page)
        written = time.perf_counter() - start
        count = sum(chunk["count"] for tile in manifest["tiles"] for chunk in tile["chunks"])
        size = sum(part["bytes"] for part in manifest["parts"])
        parts = len(manifest["parts"])
        print(f"page of {count:,} Gaussians, {size / 1e6:.1f} MB, {parts} parts; written in {written:.2f} s")
        with served(page) as address:
            yield address
