"""A made-up page that is served for a while. Running this module does nothing."""

import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import made_up
from visiting import VIEWER

from dav_gswt.terrain.browser import served
from dav_gswt.terrain.page import write_page


@contextmanager
def page_of(ground: made_up.Ground) -> Iterator[str]:
    """Its address; prints how large it is."""
    with tempfile.TemporaryDirectory() as folder:
        bundle, page = Path(folder) / "bundle", Path(folder) / "page"
        manifest = made_up.write_bundle(bundle, ground)
        start = time.perf_counter()
        write_page(bundle, VIEWER, page)
        written = time.perf_counter() - start
        chunks = [chunk for tile in manifest["tiles"] for chunk in tile["chunks"]]
        count, size = (sum(chunk[key] for chunk in chunks) for key in ("count", "bytes"))
        print(f"page of {count:,} Gaussians, {size / 1e6:.1f} MB, {len(chunks)} chunks; written in {written:.2f} s")
        with served(page) as address:
            yield address
