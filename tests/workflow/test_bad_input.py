"""What a user sees who gives what cannot be used: one message with the name, and nothing half made.

Each case goes through what `make run` calls. Only the first job has to run for it.
"""

import os
import re
import time

import numpy as np
import pytest
from fixtures.runs import TINY, USUAL

from dav_gswt.files import read_json
from dav_gswt.images import image_files

pytestmark = pytest.mark.slow
WIDTH, HEIGHT = 320, 240


def noise(seed: int, height: int = HEIGHT, width: int = WIDTH):
    return np.random.default_rng(seed).random((height, width, 3)).astype(np.float32)


def noisy_photos(folder, count: int) -> None:
    for number in range(count):
        image_files.write_png(folder / f"{number}.png", noise(number))


def one_that_is_text(folder) -> None:
    noisy_photos(folder, 2)
    (folder / "3.jpg").write_text("this is no photo")


@pytest.fixture
def refused(run, checkout, tmp_path):
    """Run a scene that must be refused; returns the lines that the user sees, without the count of jobs."""

    def call(scene: str):
        (tmp_path / "mine.yaml").write_text(f"scene: mine\nscenes: {{mine: {scene}}}\n")
        checkout(tmp_path)
        done = run(tmp_path, "--configfile", TINY, "mine.yaml")
        assert done.returncode == 1 and "Traceback" not in done.stdout, done.stdout
        rule, log = re.search(r"^(\w+) is not finished; its log: (\S+)$", done.stdout, re.M).groups()
        lines = [line.strip() for line in done.stdout.splitlines() if line.startswith("  ")]
        assert lines[-1] in (tmp_path / log).read_text()
        assert done.stdout.splitlines()[-1].startswith("Not finished.")
        left = (
            [p for p in (tmp_path / "results/mine").rglob("*") if p.is_file()]
            if (tmp_path / "results").exists()
            else []
        )
        assert not left, f"{rule} left {left}"
        return lines

    return call


PHOTOS = "{kind: photos, folder: photos, size: 320, start: 3, agent: replay, preset: draft, tiling: semantic}"


@pytest.mark.parametrize(
    "fill, said",
    [
        pytest.param(one_that_is_text, "photos/3.jpg: ", id="not an image"),
        pytest.param(
            lambda folder: noisy_photos(folder, 4),
            "photos: no two of the 4 photos show the same ground",
            id="no overlap",
        ),
    ],
)
def test_photos_that_cannot_be_used_are_named(refused, tmp_path, fill, said):
    (tmp_path / "photos").mkdir()
    fill(tmp_path / "photos")
    last = refused(PHOTOS)[-1]
    assert last.startswith(said) and ("; " in last or ": " in last.removeprefix(said))


def test_a_field_that_cannot_be_used_is_named(refused, tiny, tmp_path):
    whole = (tiny.round / "field.ply").read_bytes()
    (tmp_path / "given.ply").write_bytes(whole[: len(whole) // 2])
    last = refused("{kind: field, field: given.ply, up: [0, 0, 1], preset: draft, tiling: semantic}")[-1]
    assert re.match("given.ply: not a readable PLY .*early end-of-file", last)


@pytest.fixture
def some_of_the_beach(photo_sets, tmp_path):
    """Ten photos of the beach, small, every other one of them smaller still."""
    (tmp_path / "photos").mkdir()
    for number, path in enumerate(sorted((photo_sets / "brighton_beach/images").glob("*.jpg"))[:10]):
        photo = image_files.read_photo(path)
        share = (640 if number % 2 else 512) / max(photo.shape[:2])
        small = image_files.shrink_image(photo, round(photo.shape[1] * share), round(photo.shape[0] * share))
        image_files.write_png(tmp_path / "photos" / f"{number}.png", small)
    return tmp_path


def test_photos_of_mixed_sizes_find_their_places(snakemake, some_of_the_beach):
    scene = PHOTOS.replace("size: 320", "size: 640")
    (some_of_the_beach / "mine.yaml").write_text(f"scene: mine\nscenes: {{mine: {scene}}}\n")
    configs = (USUAL, TINY, some_of_the_beach / "mine.yaml")
    snakemake(some_of_the_beach, "--cores", "2", "results/mine/photos/ground.json", configs=configs)
    frame = read_json(some_of_the_beach / "results/mine/photos/ground.json")
    assert frame["images"] == 10 and frame["registered"] >= 8
    assert all(left["reason"] for left in frame["left_out"])


def test_a_missing_folder_of_photos_is_named(run, checkout, tmp_path):
    (tmp_path / "missing.yaml").write_text("scenes: {copr_dunes: {folder: photos/of_nothing}}\n")
    done = run(checkout(tmp_path / "clone"), "--scene", "copr_dunes", "--configfile", tmp_path / "missing.yaml")
    assert done.returncode == 1 and "config: scenes.copr_dunes.folder: there is no photos/of_nothing" in done.stdout
    assert len(done.stdout.splitlines()) <= 4, done.stdout


def test_a_photo_from_the_future_is_named_before_the_work(snakemake, tmp_path):
    """Snakemake refuses results that are older than their inputs, once a job has ended."""
    (photo := tmp_path / "a.jpg").touch()
    os.utime(photo, (0, time.time() + 3600))
    scene = f"{{kind: photos, folder: {tmp_path}, size: 64, start: 8, agent: replay, preset: draft, tiling: auto}}"
    (tmp_path / "mine.yaml").write_text(f"scene: mine\nscenes: {{mine: {scene}}}\n")
    target = "results/mine/photos/ground.json"
    done = snakemake(tmp_path, target, "--dry-run", configs=(USUAL, tmp_path / "mine.yaml"), check=False)
    assert done.returncode and f"config: scenes.mine.folder: {photo} is dated in the future" in done.stdout
