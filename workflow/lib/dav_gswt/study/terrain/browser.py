"""A headless Chromium that visits a page served on loopback. Needs playwright, which the tests' requirements bring."""

import shutil
import threading
from contextlib import contextmanager
from pathlib import Path

from dav_gswt.errors import InputError
from dav_gswt.terrain import serve

FLAGS = [  # software rendering: the same on every machine, with or without a GPU
    "--headless",
    "--no-sandbox",
    "--disable-gpu",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
]


def chromium_path() -> str | None:
    """The system's Chromium, if there is one."""
    return shutil.which("chromium") or shutil.which("chromium-browser")


@contextmanager
def served(folder: Path):
    """The address of a page folder while the block runs. Raises: InputError: there is no page."""
    http = serve.create_server(folder, 0)
    thread = threading.Thread(target=http.serve_forever, kwargs={"poll_interval": 0.02}, daemon=True)
    thread.start()
    try:
        yield f"http://{serve.HOST}:{http.server_address[1]}/"
    finally:
        http.shutdown()
        http.server_close()
        thread.join()


@contextmanager
def chromium():
    """A browser while the block runs. Raises: InputError: there is no Chromium, or no playwright to drive it."""
    if not (path := chromium_path()):
        raise InputError("the page is measured in Chromium, and there is none here: install the package chromium")
    try:
        from playwright.sync_api import sync_playwright
    except ImportError:
        raise InputError(
            "the page is measured through playwright, which is not installed: pip install -r requirements-test.lock"
        ) from None
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=path, args=FLAGS)
        yield browser
        browser.close()
