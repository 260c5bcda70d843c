"""Another program's fit beside ours: the program is a stand-in that draws the photo it is told to leave out."""

import sys
from dataclasses import replace

import numpy as np
import pytest
from fixtures import ground as made

from dav_gswt.errors import InputError
from dav_gswt.images import image_files
from dav_gswt.photos.colmap_model import ColmapModel, read_colmap_model
from dav_gswt.study import fit_profile, markdown, peers

POINTS = np.random.default_rng(0).uniform(0, 3, (50, 3))
COLOURS = np.full((50, 3), 0.5, np.float32)
STAND_IN = """#!{python}
import pathlib, shutil, sys, time
given = sys.argv
photo = pathlib.Path(given[1]) / "images" / given[given.index("--val-image") + 1]
out = pathlib.Path(given[given.index("--val-render") + 1])
print("Using CPU")
for step in (10, 20):
    shutil.copyfile(photo, out / f"{{step}}.png")
time.sleep({rest})
"""


@pytest.fixture
def photos():
    none = np.zeros(0, int)
    model = ColmapModel((), (), POINTS, COLOURS, none, none, np.zeros((0, 2)))
    frame = replace(made.FRAME, kind="synthetic")
    return fit_profile.PhotoSet(frame, model, made.photos(4), {"test": made.photos(5)[4:]})


@pytest.fixture
def program(tmp_path):
    """Make a program that draws the photo it is to leave out, twice, and then rests."""

    def make(rest=0.0):
        path = tmp_path / "program"
        path.write_text(STAND_IN.format(python=sys.executable, rest=rest))
        path.chmod(0o755)
        return str(path)

    return make


def test_the_middle_test_photo_is_kept(photos):
    more = replace(photos, tests={"test": made.photos(5)})
    assert peers.test_photo(peers.select_photos(more)).name == "photo_2"


def test_a_project_has_all_photos_their_cameras_and_all_points(photos, tmp_path):
    peers.write_project(photos, tmp_path)
    model = read_colmap_model(tmp_path / "sparse/0")
    assert len(model.names) == 5 and len(model.points) == 50
    for name, camera, view in zip(model.names, model.cameras, [*photos.train, *photos.tests["test"]], strict=True):
        shown = image_files.read_photo(tmp_path / "images" / name)
        assert np.abs(shown - view.image).max() < 1 / 254 + 1e-6
        assert np.allclose(camera.centre, view.camera.centre)


@pytest.mark.parametrize("rest", [0.0, 60.0])
def test_pictures_are_listed_when_the_program_ends_and_when_its_time_is_over(photos, program, tmp_path, rest):
    peers.write_project(photos, tmp_path)
    drawn = peers.run_opensplat(program(rest), tmp_path, "photo_4.png", 6.0)
    assert [step for _, step, _ in drawn] == [10, 20]
    assert all(-0.1 < seconds < 6 for seconds, _, _ in drawn)
    rows = peers.judge_drawn(drawn, photos)
    assert all(row["psnr"] > 45 for row in rows), "it is the photo"


def test_a_program_that_is_not_there_is_named():
    with pytest.raises(InputError, match=r"compare: opensplat: there is no program '/nowhere/opensplat'; build"):
        peers.find_program("/nowhere/opensplat")


def test_a_program_is_found_by_its_path(program):
    assert peers.find_program(path := program()) == path


def test_a_program_that_draws_nothing_is_quoted(photos, tmp_path):
    path = tmp_path / "program"
    path.write_text("#!/bin/sh\necho no such option\nexit 1\n")
    path.chmod(0o755)
    with pytest.raises(InputError, match="drew nothing in 2 s: no such option"):
        peers.run_opensplat(str(path), tmp_path, "photo_4.png", 2.0)


def test_the_page_and_the_figure_show_both_programs(photos, tmp_path, root):
    rows = [
        {
            "program": program,
            "seconds": s * step,
            "step": step,
            "gaussians": 9,
            "psnr": 25.0,
            "psnr_colour_corrected": 27.0 + step,
        }
        for program, s in ((peers.OURS, 0.1), (peers.OPENSPLAT, 2.0))
        for step in (1, 2, 3, 4)
    ]
    peers.plot_programs(rows, tmp_path / "fitters.png")
    assert image_files.read_photo(tmp_path / "fitters.png").std() > 0.01
    renderer = {"name": "cpu"}
    facts = {"version": "1.0", "renderer": renderer, "processor": "a processor", "cores": 2}
    values = peers.describe(rows, photos, {"scene": "dunes", "size": 48, "seconds": 9.0}, facts)
    text = markdown.render_template(root / "workflow/report/fitters.md", values)
    ours, other = (line.split("|") for line in text.splitlines() if line.startswith(("| dav-gswt", "| opensplat")))
    assert [cell.strip() for cell in ours[2:5]] == ["0.1", "0.4", "never"]
    assert [cell.strip() for cell in other[2:5]] == ["2.0", "8.0", "never"]
    assert "2 cores of a processor" in text
