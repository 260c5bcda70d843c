"""`dav-gswt inspect` as it is typed: what it opens, what it saves, what it answers."""

import numpy as np
import pytest

from dav_gswt.cli.main import main
from dav_gswt.errors import InputError
from dav_gswt.images import image_files
from dav_gswt.inspect import plot, readers


@pytest.mark.parametrize(
    "where, shown",
    [
        ("{round}", "Gaussians"),
        ("{round}/levels", "level 0, level 1, level 2 of 3"),
        ("{scored}", "12 candidates; 0 chosen"),
        ("{photos}", "3 cameras"),
        ("{start}/views.json", "3 cameras"),
        ("{round}/capture", "5 cameras"),
        ("{tiles}/tiles", "16 tiles"),
        ("{round}/ground.exr", "96 x 96 cells"),
        ("{round}/maps.npz", "by uncertainty"),
    ],
)
def test_every_artefact_is_known_by_its_name(tree, where, shown):
    path = where.format(**vars(tree), tiles=tree.tiles)
    found = readers.read_scene(type(tree.photos)(path), 300_000)
    assert any(shown in note for note in found.notes), found.notes
    assert found.meshes and all(np.isfinite(mesh.points).all() for mesh, _ in found.meshes)


def test_what_is_not_understood_is_answered_with_what_is(tree, tmp_path):
    (tmp_path / "notes.txt").write_text("x")
    for path, options, said in (
        (tmp_path, {}, "files that are understood: levels.json"),
        (tmp_path / "notes.txt", {}, "files that are understood"),
        (tmp_path / "nothing.ply", {}, "no such file or folder"),
        (tree.round / "field.ply", {"channel": "Z"}, "--channel: means nothing .* knows --colour"),
        (tree.round / "levels", {"level": 3}, "--level 3: .* has 0, 1, 2"),
    ):
        with pytest.raises(InputError, match=said):
            readers.read_scene(path, 100, **options)


def test_pictures_of_other_formats_or_sizes_are_refused(tree, tmp_path, capsys):
    assert main(["inspect", str(tree.photos), "--save", str(tmp_path / "a.jpg")]) == 1
    assert "pictures end in .png and pages in .html" in capsys.readouterr().err
    for bad in (["--size", "15", "99"], ["--size", "8193", "99"], ["--most", "0"]):
        assert main(["inspect", str(tree.photos), "--save", str(tmp_path / "a.png"), *bad]) == 1
        assert "--size goes from 16 to 8192" in capsys.readouterr().err


def test_a_picture_shows_colours_where_they_belong(drawable, tmp_path):
    values = np.repeat(np.repeat(np.array([[0.0, 1.0], [1.0, 1.0]]), 8, 0), 8, 1)
    image_files.write_exr(tmp_path / "uncertainty.exr", {"uncertainty": values})
    out = tmp_path / "a.png"
    assert main(["inspect", str(tmp_path / "uncertainty.exr"), "--save", str(out), "--size", "400", "300"]) == 0
    picture = image_files.read_photo(out)
    assert picture.shape == (300, 400, 3)
    warm = (picture[..., 0] > 0.6) & (picture[..., 2] < 0.3)
    cool = (picture[..., 2] > 0.6) & (picture[..., 0] < 0.3)
    upper = slice(None, 225)  # below stand the letters and the bar
    rows, columns = np.nonzero(cool[upper])
    others, beside = np.nonzero(warm[upper])
    assert 2.5 < len(others) / len(rows) < 3.5  # three quarters are warm
    assert rows.max() < others.max() and columns.max() < beside.max()  # the cool one lies in the upper left


@pytest.fixture
def page(drawable, tree, tmp_path):
    assert main(["inspect", str(tree.round / "poses.json"), "--save", str(tmp_path / "a.html")]) == 0
    return tmp_path / "a.html"


def test_a_page_says_what_it_shows_and_forbids_all_requests(page):
    text = page.read_text()
    assert "12 candidates; 2 chosen" in text and plot.POLICY in text and plot.ICON not in text
    assert "exemplar" in text and "uncertainty u = W2: 0" in text


@pytest.mark.slow
def test_a_page_draws_and_asks_for_nothing(page, chromium):
    asked, cried = [], []
    shown = chromium.new_context(offline=True).new_page()
    shown.on("request", lambda request: asked.append(request.url))
    shown.on("pageerror", lambda error: cried.append(str(error)))
    shown.on("console", lambda line: cried.append(line.text) if line.type == "error" else None)
    shown.goto(f"file://{page}")
    shown.wait_for_selector(".content canvas", timeout=60_000)
    shown.context.close()
    assert asked == [f"file://{page}"] and not cried
