"""What other programs draw of exports: Spark and three.js in headless Chromium, MuJoCo by EGL."""

import importlib
import importlib.util
import io
import os
import threading
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import UInt8
from numpy import ndarray as Array
from PIL import Image

from dav_gswt.errors import InputError
from dav_gswt.study.terrain.browser import chromium

WIDTH, HEIGHT = 240, 160
FRAMES = 12  # after which examples/exits stands still
MUJOCO = "mujoco"


def draw_exits(server: Path | str, page: Path, exports: Path, pictures: list[Path]) -> None:
    """Draw pictures, named exit_{name}.jpg, of what `dav-gswt export` wrote.

    Args:   server: examples/serve.py. page: of the terrain.
    Raises: InputError: Chromium, node_modules or mujoco is not here.
    """
    if not (Path(server).parent / "node_modules").is_dir():
        raise InputError("examples/node_modules is missing: npm ci --prefix examples")
    drawn = {path: path.stem.removeprefix("exit_") for path in pictures}
    if MUJOCO in drawn.values():
        _save(draw_ground(exports / "ground/ground.xml"), next(p for p, name in drawn.items() if name == MUJOCO))
    found = importlib.util.spec_from_file_location("serve", server)
    assert found and found.loader
    module = importlib.util.module_from_spec(found)
    found.loader.exec_module(module)
    with module.create_server(page, exports, 0) as http, chromium() as browser:
        threading.Thread(target=http.serve_forever, daemon=True).start()
        for path, name in drawn.items():
            if name != MUJOCO:
                address = f"http://127.0.0.1:{http.server_address[1]}/exits/?show={name}"
                _save(visit(browser, address), path)
        http.shutdown()


def visit(browser, address: str) -> UInt8[Array, "h w 3"]:
    """What a page of examples/exits shows."""
    with browser.new_context(viewport={"width": WIDTH, "height": HEIGHT}) as context:
        tab = context.new_page()
        tab.goto(address)
        told = "document.querySelector('p').textContent.split('frame ')[1]"
        tab.wait_for_function(f"+{told} === {FRAMES}", timeout=120_000)
        tab.add_style_tag(content="p { display: none }")
        return np.asarray(Image.open(io.BytesIO(tab.screenshot())).convert("RGB"))


def draw_ground(model: Path) -> UInt8[Array, "h w 3"]:
    """MuJoCo's own picture of a model of exports/ground. Raises: InputError: the package is not here."""
    os.environ.setdefault("MUJOCO_GL", "egl")  # before the package is loaded
    try:
        mujoco: Any = importlib.import_module("mujoco")
    except ImportError:
        raise InputError("mujoco is not installed: .venv/bin/pip install mujoco") from None
    loaded = mujoco.MjModel.from_xml_path(str(model))
    data, camera = mujoco.MjData(loaded), mujoco.MjvCamera()
    mujoco.mj_forward(loaded, data)
    camera.distance, camera.azimuth, camera.elevation = 5.0, 57.0, -22.0
    with mujoco.Renderer(loaded, HEIGHT, WIDTH) as renderer:
        renderer.update_scene(data, camera)
        return renderer.render()


def _save(picture: UInt8[Array, "h w 3"], path: Path) -> None:
    Image.fromarray(picture).save(path, quality=88)
