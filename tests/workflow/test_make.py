"""`dav-gswt make` from photos to a terrain, as somebody calls it, with little work in each stage."""

import re
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import yaml
from fixtures import imported_models as project
from fixtures import photos as synth
from PIL import Image

from dav_gswt.cli import make
from dav_gswt.field import read_field
from dav_gswt.files import digest_files
from dav_gswt.geometry.scene_frame import read_scene_frame
from dav_gswt.images import image_files
from dav_gswt.photos.capture_record import read_capture_record
from dav_gswt.photos.colmap_model import read_colmap_model
from dav_gswt.photos.recognition import recognize_input
from dav_gswt.photos.sfm.gps import fit_similarity
from dav_gswt.photos.view_split import read_view_split
from dav_gswt.views.candidates import list_remaining
from dav_gswt.views.selection import read_pose_selection

pytestmark = pytest.mark.slow


REDUCED = {
    "fit_size": 256,
    "spacing": 1.5,
    "max_gaussians": 40000,
    "steps": 80,
    "steps_per_photo": 5,
    "level_steps": 10,
}
GROUND = synth.texture(np.random.default_rng(4))  # of `project.shoot`
SETTINGS = {"presets": {"draft": REDUCED}, "stills": [160, 90], "lpips": "none", "rounds": 2, "k": 1}


@pytest.fixture
def make_in(tmp_path):
    """Call `dav-gswt make` of a folder in tmp_path, with settings that cost little; returns what it said."""

    def call(source: str, *options: str, code: int = 0) -> str:
        out = tmp_path / make.name_terrain(tmp_path / source)
        if not out.exists():
            found = recognize_input([tmp_path / source])
            scenes = {found.name: found.entry | {"preset": "draft"}}
            out.mkdir()
            make.write_scene(out / make.SCENE_FILE, SETTINGS | {"scene": found.name, "scenes": scenes}, "")
        command = [sys.executable, "-m", "dav_gswt.cli.main", "make", source, "--cores", "2", *options]
        done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
        assert done.returncode == code and "Traceback" not in done.stdout + done.stderr, done.stdout + done.stderr
        return done.stdout + done.stderr

    return call


@pytest.fixture
def colmap_project(tmp_path):
    """A COLMAP project of eight photos of even ground."""
    project.shoot(tmp_path / "field/images")
    project.write_colmap(tmp_path / "field/sparse/0")
    return tmp_path / "field"


@pytest.fixture
def beach_photos(photo_sets, tmp_path):
    """Ten photos of the beach, small, with their EXIF; and two more."""
    (tmp_path / "beach").mkdir()
    (tmp_path / "later").mkdir()
    for number, path in enumerate(sorted((photo_sets / "brighton_beach/images").glob("*.jpg"))[:12]):
        with Image.open(path) as photo:
            exif, small = photo.getexif(), photo.reduce(2)
        small.save(tmp_path / ("beach" if number < 10 else "later") / path.name, exif=exif, quality=92)
    return tmp_path / "beach"


def test_photos_added_later_are_used_and_a_page_holds_no_position(make_in, beach_photos, tmp_path):
    make_in("beach")
    out = tmp_path / "beach-terrain"
    before = {name: digest_files(out / name) for name in ("page/davgswt.json", "field.ply", "terrain.png")}
    frame = read_scene_frame(out / "results/beach/photos/ground.json")
    assert frame.images == 10 and frame.georeference
    place = frame.georeference
    for path in (path for path in out.glob("page/**/*") if path.is_file()):
        data = path.read_bytes()
        assert b"Exif" not in data and b"georeference" not in data, path
        for number in (place.latitude, place.longitude):
            assert f"{abs(number):.2f}".encode() not in data, path
    for path in (tmp_path / "later").iterdir():
        shutil.copy(path, beach_photos)
    assert "jobs done" in make_in("beach")
    assert read_scene_frame(out / "results/beach/photos/ground.json").images == 12
    assert all(digest_files(out / name) != digest for name, digest in before.items())
    assert "Up to date" in make_in("beach")


def test_a_project_becomes_a_terrain(make_in, colmap_project, tmp_path):
    said = make_in("field")
    assert "field: 8 photos with cameras of COLMAP" in said
    out = tmp_path / "field-terrain"
    for name in ("page/index.html", "page/davgswt.json", "terrain.png", "field.ply", "report.html", "scene.yaml"):
        assert (out / name).stat().st_size, name
    assert image_files.read_photo(out / "terrain.png").std() > 0.02 and len(read_field(out / "field.ply")) > 1000
    assert "Up to date" in make_in("field")


def take_requested_photos(out: Path, round_number: int, drop: Path) -> list[str]:
    """What a person does who follows the shot list of a round. Returns the names of its poses.

    The folder's photos are of `project`, whose cameras are known in its own world, and placed in the terrain's.
    """
    results, scene = out / "results/field", yaml.safe_load((out / make.SCENE_FILE).read_text())
    frame = read_scene_frame(results / "photos/ground.json")
    model = read_colmap_model(results / "photos/sparse")
    made = np.stack([-r.T @ t for r, t in zip(project.SCENE.rotations, project.SCENE.translations, strict=True)])
    order = [project.SCENE.names.index(name) for name in model.names]
    scale, turn, shift, _ = fit_similarity(made[order], np.stack([camera.centre for camera in model.cameras]))
    (chosen,) = results.glob(f"seed0/draft/*/iter{round_number}/poses.json")
    earlier = sorted(chosen.parents[1].glob("iter*/capture"))
    entry = make.load_settings(scene)["scenes"]["field"]
    split = read_view_split(results / "seed0/views.json")
    listed = {
        pose.name: camera for pose, camera in list_remaining(entry, frame, results / "photos/sparse", split, earlier)
    }
    names = [pose.name for pose in read_pose_selection(chosen).poses]
    for name in names:
        wanted = listed[name]
        move = (wanted.rotation @ shift + wanted.translation) / scale
        picture = project.photograph(project.lens(), wanted.rotation @ turn, move, GROUND)
        image_files.write_png(drop / f"my {round_number} {name}.png", picture)
    return names


def test_a_person_takes_photos_in_two_rounds(make_in, colmap_project, tmp_path):
    out, asked = tmp_path / "field-terrain", []
    for number in (1, 2):
        said = make_in("field", "--capture", "handheld", code=1)
        drop = Path(re.search(r"Put the photos into (\S+) and run", said)[1])
        assert drop == out / "captures/field/drop" and (drop.parent / "shot-list/index.html").is_file()
        assert "photos of 1 pose are missing" in said
        asked += take_requested_photos(out, number, drop)
    make_in("field")
    taken = [photo for path in sorted(out.glob("results/**/capture")) for photo in read_capture_record(path)]
    assert sorted(photo.pose.name for photo in taken) == sorted(asked) and len(set(asked)) == 2
    assert all(photo.distance < 0.05 for photo in taken)
    assert (out / "page/index.html").is_file()
