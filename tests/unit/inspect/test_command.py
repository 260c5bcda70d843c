"""`dav-gswt inspect` as it is typed: what it opens, what it saves, what it answers."""

import importlib.util

import numpy as np
import pytest

from dav_gswt.cli.main import main
from dav_gswt.errors import InputError
from dav_gswt.images import image_files
from dav_gswt.inspect import artifacts, command, saving
from dav_gswt.inspect.options import ViewOptions


@pytest.fixture(autouse=True)
def nowhere(monkeypatch):
    """No display, whatever this machine has."""
    for name in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)


@pytest.mark.parametrize(
    "where, shown",
    [
        ("{round}", "Gaussians"),
        ("{round}/levels", "level 1"),
        ("{round}/levels/level1.ply", "Gaussians"),
        ("{round}/poses.json", "2 chosen"),
        ("{scored}", "12 candidates"),
        ("{photos}", "3 cameras"),
        ("{start}/views.json", "3 cameras"),
        ("{round}/capture", "5 cameras"),
        ("{tiles}", "16 tiles"),
        ("{tiles}/tiles", "16 tiles"),
        ("{tiles}/tiles/labels.npz", "16 tiles"),
        ("{tiles}/tiles/lod0_tile_03.ply", "Gaussians"),
        ("{round}/ground.exr", "96 x 96 cells"),
        ("{round}/uncertainty.exr", "pictures: 2"),
        ("{round}/maps.npz", "by uncertainty"),
    ],
)
def test_every_artefact_is_known_by_its_name(tree, where, shown):
    path = where.format(**vars(tree), tiles=tree.tiles)
    found = artifacts.build_scene(type(tree.photos)(path), ViewOptions())
    assert any(shown in note for note in found.notes), found.notes
    assert found.layers and (found.high >= found.low).all()


def test_what_is_not_understood_is_answered_with_what_is(tree, tmp_path):
    (tmp_path / "notes.txt").write_text("x")
    for path in (tmp_path, tmp_path / "notes.txt"):
        with pytest.raises(InputError, match="understood are fields"):
            artifacts.build_scene(path, ViewOptions())
    with pytest.raises(InputError, match="no such file or folder"):
        artifacts.build_scene(tmp_path / "nothing.ply", ViewOptions())
    with pytest.raises(InputError, match="--channel: means nothing .* knows --colour"):
        artifacts.build_scene(tree.round / "field.ply", ViewOptions(channel="Z"))


def test_without_the_extra_one_line_says_how_to_install_it(tree, tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None)
    assert main(["inspect", str(tree.photos), "--save", str(tmp_path / "a.png")]) == 1
    said = capsys.readouterr().err
    assert said.count("\n") == 1 and "pyvista" in said and '-e ".[inspect]"' in said


def test_without_a_display_a_file_is_asked_for(tree, monkeypatch, capsys):
    monkeypatch.setattr(command, "require_extra", lambda: None)
    monkeypatch.setattr(saving.sys, "platform", "linux")
    assert main(["inspect", str(tree.photos)]) == 1
    assert "add --save FILE.png or --save FILE.html" in capsys.readouterr().err


def test_other_formats_and_sizes_are_refused(tree, tmp_path, capsys):
    assert main(["inspect", str(tree.photos), "--save", str(tmp_path / "a.jpg")]) == 1
    assert "pictures end in .png and pages in .html" in capsys.readouterr().err
    for bad in ("12", "0x5", "99999x10", "9000x10"):
        with pytest.raises(SystemExit):
            main(["inspect", str(tree.photos), "--size", bad])
        assert "--size" in capsys.readouterr().err


def test_where_nothing_draws_the_packages_are_named(drawable, tree, tmp_path, monkeypatch, capsys):
    monkeypatch.setenv(saving.VARIABLE, "vtkNoSuchWindow")
    monkeypatch.setattr(saving.sys, "platform", "linux")
    assert main(["inspect", str(tree.photos), "--save", str(tmp_path / "a.png")]) == 1
    said = capsys.readouterr().err
    assert "vtkNoSuchWindow" in said and "sudo apt install libegl1 libgl1-mesa-dri" in said
    assert not list(tmp_path.iterdir())


def test_a_picture_shows_colours_where_they_belong(drawable, tmp_path):
    values = np.repeat(np.repeat(np.array([[0.0, 1.0], [1.0, 1.0]]), 8, 0), 8, 1)
    image_files.write_exr(tmp_path / "uncertainty.exr", {"uncertainty": values})
    out = tmp_path / "a.png"
    assert main(["inspect", str(tmp_path / "uncertainty.exr"), "--save", str(out), "--size", "400x300"]) == 0
    picture = image_files.read_photo(out)
    assert picture.shape == (300, 400, 3)
    warm = (picture[..., 0] > 0.6) & (picture[..., 2] < 0.3)
    cool = (picture[..., 2] > 0.6) & (picture[..., 0] < 0.3)
    upper = slice(None, 225)  # below stand the letters and the bar
    rows, columns = np.nonzero(cool[upper])
    others, beside = np.nonzero(warm[upper])
    assert 2.5 < len(others) / len(rows) < 3.5  # three quarters are warm
    assert rows.max() < others.max() and columns.max() < beside.max()  # the cool one lies in the upper left


def test_a_page_is_the_same_each_time_and_asks_for_nothing(drawable, tree, tmp_path, chromium):
    for name in ("a", "b"):
        assert main(["inspect", str(tree.round / "poses.json"), "--save", str(tmp_path / f"{name}.html")]) == 0
    text = (tmp_path / "a.html").read_bytes()
    assert text == (tmp_path / "b.html").read_bytes()
    asked, cried = [], []
    page = chromium.new_context(viewport={"width": 600, "height": 500}, offline=True).new_page()
    page.on("request", lambda request: asked.append(request.url))
    page.on("pageerror", lambda error: cried.append(str(error)))
    page.on("console", lambda line: cried.append(line.text) if line.type == "error" else None)
    page.goto(f"file://{tmp_path / 'a.html'}")
    page.wait_for_selector(".content canvas", timeout=60_000)
    warm = cool = 0
    for _ in range(100):  # until candidates of both kinds are drawn
        page.screenshot(path=str(tmp_path / "seen.png"))
        picture = image_files.read_photo(tmp_path / "seen.png")[200:]
        warm = (picture[..., 0] - picture[..., 2] > 0.4).sum()
        cool = (picture[..., 2] - picture[..., 0] > 0.4).sum()
        if min(warm, cool) > 50:
            break
        page.wait_for_timeout(200)
    said = page.inner_text("#about")
    page.context.close()
    assert "12 candidates; 2 chosen" in said and "drag to turn" in said
    assert asked == [f"file://{tmp_path / 'a.html'}"] and not cried
    assert warm > 50 and cool > 50
