"""PLY files: a round trip is exact, files of other programs are read, broken ones raise errors that name the file."""

from dataclasses import replace

import numpy as np
import pytest
from fixtures.random_field import random_field
from plyfile import PlyData, PlyElement

from dav_gswt.errors import InputError
from dav_gswt.field import HEADER_BYTES, GaussianField, concatenate_fields, read_field, write_field

NAMES = ["x", "y", "z", "f_dc_0", "f_dc_1", "f_dc_2", "opacity", *(f"scale_{i}" for i in range(3))]
NAMES += [f"rot_{i}" for i in range(4)]


def foreign(path, rows=3, drop=(), change=None, extra=(), text=False):
    """A 3DGS .ply as another program writes it: own order, no normals, no properties of ours."""
    names = [name for name in (*extra, *NAMES) if name not in drop]
    table = np.zeros(rows, [(name, "<f4") for name in names])
    for k, name in enumerate(names):
        table[name] = np.arange(rows) + k / 16
    for (row, name), value in (change or {}).items():
        table[name][row] = value
    PlyData([PlyElement.describe(table, "vertex")], text=text).write(str(path))
    return path


@pytest.mark.parametrize("degree", [0, 1, 2, 3])
def test_a_field_comes_back_to_the_bit(tmp_path, degree):
    field = random_field(7, degree)
    write_field(field, tmp_path / "a.ply")
    back = read_field(tmp_path / "a.ply")
    for name in GaussianField.__dataclass_fields__:
        one, two = getattr(field, name), getattr(back, name)
        assert one.dtype == two.dtype and np.array_equal(one, two), name


def test_the_same_field_gives_the_same_bytes(tmp_path):
    for name in ("a.ply", "b.ply"):
        write_field(random_field(), tmp_path / name)
    assert (tmp_path / "a.ply").read_bytes() == (tmp_path / "b.ply").read_bytes()


def test_a_field_without_gaussians_comes_back(tmp_path):
    write_field(random_field(0), tmp_path / "a.ply")
    assert len(read_field(tmp_path / "a.ply")) == 0


def test_harmonics_are_stored_channel_by_channel(tmp_path):
    """f_rest_0 to 2 are red's three coefficients of degree 1, as in the original 3DGS."""
    field = random_field(1, degree=1)
    write_field(field, tmp_path / "a.ply")
    row = PlyData.read(str(tmp_path / "a.ply"))["vertex"].data[0]
    assert [row[f"f_rest_{i}"] for i in range(9)] == field.sh[0, 1:].T.ravel().tolist()


@pytest.mark.parametrize("text", [False, True], ids=["binary", "ascii"])
def test_a_foreign_field_is_read_and_nothing_in_it_is_uncertain(tmp_path, text):
    field = read_field(foreign(tmp_path / "a.ply", text=text))
    assert field.means[1].tolist() == [1, 1 + 1 / 16, 1 + 2 / 16]
    assert field.sh.shape == (3, 1, 3) and field.quats.shape == (3, 4)
    assert not field.uncertainty.any() and not field.ground.any()


@pytest.mark.parametrize("missing", ["x", "f_dc_1", "opacity", "scale_2", "rot_3"])
def test_a_missing_property_is_named(tmp_path, missing):
    with pytest.raises(InputError, match=rf"a.ply.*{missing}"):
        read_field(foreign(tmp_path / "a.ply", drop=[missing]))


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize("name", ["x", "f_dc_2", "opacity", "scale_0", "rot_1"])
def test_a_value_that_is_not_finite_is_refused_with_its_index(tmp_path, name, value):
    with pytest.raises(InputError, match=rf"a.ply.*{name} of Gaussian 2 "):
        read_field(foreign(tmp_path / "a.ply", change={(2, name): value}))


def test_a_zero_quaternion_is_refused_with_its_index(tmp_path):
    zero = {(1, f"rot_{i}"): 0.0 for i in range(4)}
    with pytest.raises(InputError, match="a.ply.*Gaussian 1 "):
        read_field(foreign(tmp_path / "a.ply", change=zero))


@pytest.mark.parametrize("count", [3, 8, 10, 12])
def test_harmonics_that_are_not_whole_are_refused(tmp_path, count):
    with pytest.raises(InputError, match=f"a.ply.*{count} f_rest"):
        read_field(foreign(tmp_path / "a.ply", extra=[f"f_rest_{i}" for i in range(count)]))


@pytest.mark.parametrize("share", [0.0, 0.05, 0.5, 0.99])
@pytest.mark.parametrize("text", [False, True], ids=["binary", "ascii"])
def test_a_file_cut_short_is_refused_by_name(tmp_path, share, text):
    path = foreign(tmp_path / "a.ply", rows=200, text=text)
    path.write_bytes(path.read_bytes()[: int(path.stat().st_size * share)])
    with pytest.raises(InputError, match="a.ply"):
        read_field(path)


@pytest.mark.parametrize("count", [b"99999999999999", b"-1"])
def test_a_header_with_a_false_count_is_refused_before_anything_is_allocated(tmp_path, count):
    path = foreign(tmp_path / "a.ply")
    path.write_bytes(path.read_bytes().replace(b"element vertex 3", b"element vertex " + count))
    with pytest.raises(InputError, match="a.ply"):
        read_field(path)


def with_comment(path, line):
    path.write_bytes(path.read_bytes().replace(b"element vertex", line + b"\nelement vertex", 1))


@pytest.mark.parametrize(
    "line", [b"comment " + b"x" * HEADER_BYTES, b"comment end_header"], ids=["long", "a false end"]
)
def test_a_comment_does_not_hide_a_false_count(tmp_path, line, monkeypatch):
    path = foreign(tmp_path / "a.ply")
    with_comment(path, line)
    path.write_bytes(path.read_bytes().replace(b"element vertex 3", b"element vertex 9999999999"))
    monkeypatch.setattr(PlyData, "read", lambda *_: pytest.fail("the vertices are allocated"))
    with pytest.raises(InputError, match="a.ply"):
        read_field(path)


def test_a_comment_that_names_the_end_of_the_header_is_read_over(tmp_path):
    path = foreign(tmp_path / "a.ply")
    with_comment(path, b"comment end_header")
    assert len(read_field(path)) == 3


def with_list(path, name):
    """A foreign field whose property of this name is a list of two numbers."""
    kinds = [(other, "O" if other == name else "<f4") for other in [*NAMES, "uncertainty", "ground", "imagined"]]
    table = np.ones(3, kinds)
    for row in table:
        row[name] = np.zeros(2, np.float32)
    PlyData([PlyElement.describe(table, "vertex", val_types={name: "f4"})]).write(str(path))
    return path


@pytest.mark.parametrize("name", ["x", "f_dc_1", "rot_3", "uncertainty", "ground", "imagined"])
def test_a_property_that_is_a_list_is_refused_by_name(tmp_path, name):
    with pytest.raises(InputError, match=rf"a.ply: property {name} is a list; export it again"):
        read_field(with_list(tmp_path / "a.ply", name))


@pytest.mark.parametrize("value", [-0.1, 1.1, 1e30, np.nan, np.inf])
def test_an_uncertainty_outside_0_to_1_is_refused_with_its_index(tmp_path, value):
    path = foreign(tmp_path / "a.ply", extra=["uncertainty"], change={(0, "uncertainty"): 1, (2, "uncertainty"): value})
    with pytest.raises(InputError, match="a.ply.*uncertainty of Gaussian 2 "):
        read_field(path)


def test_an_uncertainty_that_rounding_puts_beyond_1_is_clipped(tmp_path):
    values = np.float32([1 + 2e-7, 1, -1e-7])
    path = foreign(
        tmp_path / "a.ply", extra=["uncertainty"], change={(i, "uncertainty"): v for i, v in enumerate(values)}
    )
    assert read_field(path).uncertainty.tolist() == [1, 1, 0]


@pytest.mark.parametrize(
    "content", [b"no ply at all", b"ply\n", b"\x00\xff" * 50, b"ply\nformat ascii 1.0\nend_header\n"]
)
def test_what_is_no_field_is_refused_by_name(tmp_path, content):
    (tmp_path / "a.ply").write_bytes(content)
    with pytest.raises(InputError, match="a.ply"):
        read_field(tmp_path / "a.ply")


def test_a_mesh_is_refused_by_the_property_that_it_lacks(tmp_path):
    table = np.zeros(4, [(name, "<f4") for name in "xyz"])
    PlyData([PlyElement.describe(table, "vertex")]).write(str(tmp_path / "mesh.ply"))
    with pytest.raises(InputError, match="mesh.ply.*f_dc_0"):
        read_field(tmp_path / "mesh.ply")


def test_a_missing_file_is_named(tmp_path):
    with pytest.raises(InputError, match="nowhere.ply"):
        read_field(tmp_path / "nowhere.ply")


def test_what_was_imagined_comes_back_and_costs_a_field_without_it_no_byte(tmp_path):
    field = random_field(6)
    assert not field.imagined.any()
    write_field(field, tmp_path / "a.ply")
    assert b"imagined" not in (tmp_path / "a.ply").read_bytes()
    marked = np.arange(6) % 2 == 0
    write_field(replace(field, imagined=marked), tmp_path / "b.ply")
    back = read_field(tmp_path / "b.ply")
    assert np.array_equal(back.imagined, marked) and np.array_equal(back[marked].imagined, np.ones(3, bool))
    assert np.array_equal(concatenate_fields([back, field]).imagined, [*marked, *np.zeros(6, bool)])


def test_a_plain_file_has_floats_alone_and_the_same_gaussians(tmp_path):
    field = replace(random_field(6, 1), imagined=np.ones(6, bool))
    write_field(field, tmp_path / "a.ply", plain=True)
    data = PlyData.read(str(tmp_path / "a.ply"))["vertex"].data
    assert {kind for _, kind in data.dtype.descr} == {"<f4"} and not {"uncertainty", "ground"} & set(data.dtype.names)
    back = read_field(tmp_path / "a.ply")
    assert np.array_equal(back.means, field.means) and np.array_equal(back.sh, field.sh)
    assert not back.imagined.any() and not back.ground.any()


@pytest.mark.parametrize("value", [2, -1, 0.5, np.nan, np.inf])
def test_a_flag_that_is_none_is_refused_with_its_index(tmp_path, value):
    path = foreign(tmp_path / "a.ply", extra=["imagined"], change={(0, "imagined"): 0, (2, "imagined"): value})
    with pytest.raises(InputError, match=r"a.ply.*imagined of Gaussian 2 "):
        read_field(path)
