"""The tutorials of docs/tutorials, each followed from its page, and what the page promises."""

import csv
import io
import re
import shutil
from pathlib import Path

import numpy as np
import pytest
from fixtures.page_visit import Visit
from fixtures.tutorials import Tutorial
from PIL import Image, ImageSequence

from dav_gswt.files import read_json
from dav_gswt.images import image_files

pytestmark = pytest.mark.slow
TINY = "--configfile config/config.yaml config/test/config.yaml"  # settings that take seconds
SIZE = {"width": 160, "height": 100}
TAKE_PHOTO = 2000  # MAV_CMD_IMAGE_START_CAPTURE
GPS = 0x8825  # the part of EXIF
REDIRECT = """
import sys
for finder in sys.meta_path:
    if files := getattr(finder, "known_source_files", None):
        files["dav_gswt.views.policies"] = {path!r}
"""


@pytest.fixture
def clone(checkout, root, tmp_path) -> Path:
    """What a reader has: a copy of the repository with an environment."""
    checkout(tmp_path)
    (tmp_path / ".venv").symlink_to(root / ".venv")
    (tmp_path / "resources").symlink_to(root / "resources")
    shutil.copytree(root / "examples", tmp_path / "examples", ignore=shutil.ignore_patterns("node_modules", "exports"))
    return tmp_path


@pytest.fixture
def desert(clone, tiny) -> Path:
    """The same after `make run`, with a tiny desert."""
    shutil.copytree(tiny.folder / "results", clone / "results", symlinks=True)
    shutil.copytree(tiny.folder / ".snakemake", clone / ".snakemake")
    return clone


@pytest.fixture
def follow(root):
    """Open a tutorial to follow it in a folder."""
    return lambda name, folder: Tutorial(root / f"docs/tutorials/{name}.md", folder)


def test_a_policy(follow, desert, root, monkeypatch):
    """The reader's library is the clone's; here only the module that the page changes is."""
    module = desert / "workflow/lib/dav_gswt/views/policies.py"
    module.parent.mkdir(parents=True)
    shutil.copy(root / module.relative_to(desert), module)
    (desert / "site").mkdir()
    (desert / "site/sitecustomize.py").write_text(REDIRECT.format(path=str(module)))
    monkeypatch.setenv("PYTHONPATH", str(desert / "site"))
    page = follow("policy", desert)
    page.step(more=TINY)
    chosen = read_json(next(desert.glob("results/desert/seed0/draft/active_around_*_k4/iter1/poses.json")))["poses"]
    azimuths = np.sort([pose["azimuth"] for pose in chosen])
    gaps = np.diff([*azimuths, azimuths[0] + 360])
    assert len(chosen) == 4 and (np.abs(gaps - 90) < 45).all()
    said = page.step()
    assert said.count("psnr") == 2 and "farthest" in said  # which the tiny run chose by
    page.end()


def test_a_sweep(follow, desert):
    page = follow("sweep", desert)
    page.step(more=TINY)
    page.step(more=TINY)
    page.step()
    page.step()
    with (desert / "results/sweeps/k.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert [row["k"] for row in rows] == ["2", "8"] and all(row["policy"] == "w2-lpips" for row in rows)
    assert all(10 < float(row["psnr"]) < 60 for row in rows)
    assert image_files.read_photo(desert / "k.png").std() > 0.02
    page.end()


def test_a_robot(follow, desert):
    pytest.importorskip("mujoco", reason="mujoco is not installed")
    page = follow("robot", desert)
    assert "pip install mujoco" in page.skip()
    page.step()
    said = page.step()
    pictures = [np.asarray(frame.convert("RGB")) for frame in ImageSequence.Iterator(Image.open(desert / "rover.webp"))]
    assert len(pictures) == 20 and np.abs(pictures[0].astype(int) - pictures[-1]).mean() > 5
    x, y, z = map(float, said.rpartition(" stands at ")[2].split(","))
    assert np.hypot(x + 5, y) > 1
    height = float(re.search(r"is (\S+) m above", page.step())[1])
    assert 0.09 < height < 0.3
    page.end()


def test_a_drone_survey(follow, clone):
    page = follow("drone-survey", clone)
    page.step()
    page.step(status=1)
    out = clone / "survey-gaps"
    flown = np.array([read_position(path) for path in (clone / "survey").iterdir()])
    features = read_json(out / "gaps.geojson")["features"]
    middles = np.array([np.mean(each["geometry"]["coordinates"][0], 0)[::-1] for each in features])
    assert len(features) >= 3 and ((flown.min(0) < middles) & (middles < flown.max(0))).all()
    items = read_json(out / "mission.plan")["mission"]["items"]
    assert 6 <= sum(item["command"] == TAKE_PHOTO for item in items) <= 30
    assert image_files.read_photo(out / "gaps.png").std() > 0.02
    page.step()
    assert read_json(out / "gaps.geojson")["features"] == [] and not (out / "mission.plan").exists()
    page.end()


def test_my_photos(follow, clone, chromium):
    page = follow("my-photos", clone)
    page.step()
    said = page.step()
    assert 25 < float(re.search(r"\(([\d.]+) dB PSNR", said)[1]) < 60
    assert image_files.read_photo(clone / "sandpit-terrain/terrain.png").std() > 0.02
    with page.serve("--port 0") as (address,), chromium.new_context(viewport=SIZE) as context:
        picture = Visit(context.new_page()).open(f"{address}?still").picture()
    assert picture.std() > 5
    page.end()


def test_three_js(follow, desert, chromium, node_modules):
    (desert / "examples/node_modules").symlink_to(node_modules)
    page = follow("three-js", desert)
    page.step()
    assert "npm ci" in page.skip()
    with page.serve("--port 0") as (_, address):
        page.write_files()
        picture = look(chromium, f"{address}?eye=2&pitch=-20")  # the tiny ground is sharp from 15 m only
    red = (picture[..., 0] > 200) & (picture[..., 1:].max(-1) < 60)
    assert 20 < red.sum() < red.size / 4 and picture[~red].std() > 5
    page.end()


def look(chromium, address: str) -> np.ndarray:
    """What the page of three.js shows to a new visitor, once Spark has sorted the Gaussians."""
    with chromium.new_context(viewport=SIZE) as context:
        tab = context.new_page()
        tab.goto(address)
        told = "document.querySelector('p').textContent"
        tab.wait_for_function(f"+{told}.split('frame ')[1] > 20 && !{told}.includes('sorting')", timeout=240_000)
        tab.add_style_tag(content="p { display: none }")
        return np.asarray(Image.open(io.BytesIO(tab.screenshot())).convert("RGB")).astype(int)


def read_position(photo: Path) -> list[float]:
    """Latitude and longitude of a photo, in degrees."""
    place = Image.open(photo).getexif().get_ifd(GPS)
    degrees = [float(d + m / 60 + s / 3600) for d, m, s in (place[2], place[4])]
    return [degrees[0] * (1 if place[1] == "N" else -1), degrees[1] * (1 if place[3] == "E" else -1)]
