"""What other programs draw of exports, and what those read that draw nothing.

Spark, three.js, SuperSplat's viewer, PlayCanvas and CesiumJS draw in headless Chromium, MuJoCo by EGL;
usd-core and GDAL read.
"""

import importlib
import importlib.util
import io
import json
import os
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any
from urllib.parse import urlencode

import numpy as np
from jaxtyping import Float, UInt8
from matplotlib.colors import LightSource
from numpy import ndarray as Array
from PIL import Image

from dav_gswt.errors import InputError
from dav_gswt.field import GaussianField
from dav_gswt.files import read_json
from dav_gswt.geometry import cameras
from dav_gswt.raster import render
from dav_gswt.study.terrain.browser import chromium

WIDTH, HEIGHT = 240, 160
FRAMES = 12  # after which examples/exits stands still
FIELD_OF_VIEW = 45.0  # degrees, of the picture's height
WIDE = float(np.degrees(2 * np.arctan(np.tan(np.radians(FIELD_OF_VIEW / 2)) * WIDTH / HEIGHT)))  # of its width
EYE, TARGET = (-1.1, -1.7, 0.8), (0.2, 0.2, 0.0)  # tile sides east, north and up of the origin, as in examples/exits
SKY = 0xB8, 0xCB, 0xDC
PAGES = {"glb": "exits/playcanvas.html", "3dtiles": "exits/cesium.html"}  # below examples/
STREAMED = "streamed_sog"
SUPERSPLAT = "node_modules/@playcanvas/supersplat-viewer/public/index.html"
STILL, PATIENCE = 3000, 40  # milliseconds between looks at a page that does not say when it is done, and most looks


def draw_exits(server: Path | str, page: Path, exports: Path, pictures: list[Path]) -> None:
    """Draw pictures, named exit_{name}.jpg, of what `dav-gswt export` wrote.

    Args:   server: examples/serve.py. page: of the terrain.
    Raises: InputError: Chromium, node_modules or a package is not here.
    """
    if not (Path(server).parent / "node_modules/cesium").is_dir():
        raise InputError("examples/node_modules is missing or lacks cesium: npm ci --prefix examples")
    drawn = {path: path.stem.removeprefix("exit_") for path in pictures}
    here: dict[str, Callable[[Path], UInt8[Array, "h w 3"]]] = {
        "mujoco": draw_ground,
        "usd": draw_usd,
        "heights": draw_heights,
    }
    for path, name in drawn.items():
        if name in here:
            _save(here[name](exports), path)
    found = importlib.util.spec_from_file_location("serve", server)
    assert found and found.loader
    module = importlib.util.module_from_spec(found)
    found.loader.exec_module(module)
    write_supersplat_settings(exports)
    with module.create_server(page, exports, 0) as http, chromium() as browser:
        threading.Thread(target=http.serve_forever, daemon=True).start()
        for path, name in drawn.items():
            if name not in here:
                _save(visit(browser, f"http://127.0.0.1:{http.server_address[1]}/", name), path)
        http.shutdown()


def visit(browser, address: str, name: str) -> UInt8[Array, "h w 3"]:
    """What a program shows of an export. address: of examples/serve.py."""
    with browser.new_context(viewport={"width": WIDTH, "height": HEIGHT}) as context:
        tab = context.new_page()
        if name == STREAMED:
            asked = {"settings": "/exports/supersplat.json", "content": "/exports/terrain/terrain_sog/lod-meta.json"}
            tab.goto(f"{address}{SUPERSPLAT}?{urlencode(asked)}&noui&webgl&noanim&fullload")
            return _wait_until_still(tab)
        if name in PAGES:
            tab.goto(address + PAGES[name])
            return _wait_until_still(tab)
        tab.goto(f"{address}exits/?show={name}")
        told = "document.querySelector('p').textContent.split('frame ')[1]"
        tab.wait_for_function(f"+{told} === {FRAMES}", timeout=120_000)
        tab.add_style_tag(content="p { display: none }")
        return _look(tab)


def write_supersplat_settings(exports: Path) -> None:
    """The camera of the other pictures for SuperSplat's viewer, which turns files by 180 degrees about z."""
    side = read_json(exports / "terrain/terrain.json")["tile_side"]
    eye, target = ([-side * x, side * z, side * y] for x, y, z in (EYE, TARGET))
    pose = {"position": eye, "target": target, "fov": WIDE}
    off = {"enabled": False}
    effects = {
        "sharpness": off | {"amount": 0},
        "bloom": off | {"intensity": 1, "blurLevel": 2},
        "grading": off | {"brightness": 0, "contrast": 1, "saturation": 1, "tint": [1, 1, 1]},
        "vignette": off | {"intensity": 0.5, "inner": 0.3, "outer": 0.75, "curvature": 1},
        "fringing": off | {"intensity": 0.5},
    }
    settings = {
        "version": 2,
        "tonemapping": "none",
        "highPrecisionRendering": False,
        "background": {"color": [v / 255 for v in SKY]},
        "postEffectSettings": effects,
        "animTracks": [],
        "cameras": [{"initial": pose}],
        "annotations": [],
        "startMode": "default",
    }
    (exports / "supersplat.json").write_text(json.dumps(settings), encoding="utf-8")


def draw_ground(exports: Path) -> UInt8[Array, "h w 3"]:
    """MuJoCo's own picture of ground/ground.xml. Raises: InputError: the package is not here."""
    os.environ.setdefault("MUJOCO_GL", "egl")  # before the package is loaded
    mujoco = _import_package("mujoco", "mujoco")
    loaded = mujoco.MjModel.from_xml_path(str(exports / "ground/ground.xml"))
    data, camera = mujoco.MjData(loaded), mujoco.MjvCamera()
    mujoco.mj_forward(loaded, data)
    camera.distance, camera.azimuth, camera.elevation = 5.0, 57.0, -22.0
    with mujoco.Renderer(loaded, HEIGHT, WIDTH) as renderer:
        renderer.update_scene(data, camera)
        return renderer.render()


def draw_usd(exports: Path) -> UInt8[Array, "h w 3"]:
    """Our picture of what usd-core reads of terrain.usdc. Raises: InputError: the package is not here."""
    field = read_usd(exports / "terrain/terrain.usdc")
    side = read_json(exports / "terrain/terrain.json")["tile_side"]
    camera = cameras.pinhole(np.multiply(EYE, side), np.multiply(TARGET, side), WIDTH, HEIGHT, WIDE)
    seen = render(field, camera, tuple(v / 255 for v in SKY)).colour
    return np.round(255 * np.clip(seen, 0, 1)).astype(np.uint8)


def read_usd(path: Path) -> GaussianField:
    """The Gaussians of a stage whose axis up is z, by usd-core. Raises: InputError: the package is not here."""
    stage = _import_package("pxr.Usd", "usd-core").Stage.Open(str(path))
    (prim,) = [p for p in stage.Traverse() if p.GetTypeName() == "ParticleField3DGaussianSplat"]
    names = ("positions", "scales", "orientations", "opacities", "radiance:sphericalHarmonicsCoefficients")
    means, scales, xyzw, opacity, dc = (np.array(prim.GetAttribute(name).Get(), np.float32) for name in names)
    opacity = np.clip(opacity.astype(float), 1e-6, 1 - 1e-6)
    n = len(means)
    return GaussianField(
        means,
        np.log(scales),
        np.ascontiguousarray(xyzw[:, [3, 0, 1, 2]]),
        np.log(opacity / (1 - opacity)).astype(np.float32),
        dc.reshape(n, 1, 3),
        np.zeros(n, np.float32),
        np.zeros(n, bool),
    )


def draw_heights(exports: Path) -> UInt8[Array, "h w 3"]:
    """The heights that GDAL reads of ground/ground.tif, from above, lit from the north-west.

    Raises: InputError: rasterio is not here.
    """
    with _import_package("rasterio", "rasterio").open(exports / "ground/ground.tif") as image:
        heights = image.read(1).astype(float)
    return shade(heights, read_json(exports / "ground/ground.json")["heights"]["step"])


def shade(heights: Float[Array, "rows columns"], pixel: float) -> UInt8[Array, "h w 3"]:
    """A picture of heights, HEIGHT pixels high, in the colours of sand. pixel: its side, in units of the heights."""
    low, high = np.quantile(heights, [0.01, 0.99])
    known = np.clip((heights - low) / max(high - low, 1e-9), 0, 1)
    colours = np.stack([0.55 + 0.4 * known, 0.45 + 0.4 * known, 0.35 + 0.4 * known], -1)
    light = LightSource(315, 45).shade_rgb(colours, heights, dx=pixel, dy=pixel, vert_exag=1.0)
    picture = Image.fromarray(np.round(255 * np.clip(light, 0, 1)).astype(np.uint8))
    return np.asarray(picture.resize((round(HEIGHT * heights.shape[1] / heights.shape[0]), HEIGHT)))


def _import_package(name: str, package: str) -> Any:
    try:
        return importlib.import_module(name)
    except ImportError:
        raise InputError(f"{package} is not installed: .venv/bin/pip install {package}") from None


def _wait_until_still(tab) -> UInt8[Array, "h w 3"]:
    """The picture once it shows something and two looks at it are alike."""
    before = _look(tab)
    for _ in range(PATIENCE):
        tab.wait_for_timeout(STILL)
        now = _look(tab)
        if now.std() > 10 and np.abs(now.astype(int) - before).mean() < 0.2:
            return now
        before = now
    raise InputError(f"{tab.url}: the picture does not come to rest")


def _look(tab) -> UInt8[Array, "h w 3"]:
    return np.asarray(Image.open(io.BytesIO(tab.screenshot())).convert("RGB"))


def _save(picture: UInt8[Array, "h w 3"], path: Path) -> None:
    Image.fromarray(picture).save(path, quality=88)
