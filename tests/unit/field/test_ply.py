"""PLY files: a round trip is exact, files of other programs are read, broken ones raise errors that name the file."""

from dataclasses import replace

import numpy as np
import pytest
from fixtures.random_field import random_field
from plyfile import PlyData, PlyElement

from dav_gswt.errors import InputError
from dav_gswt.field import (
    HEADER_BYTES,
    THIN,
    GaussianField,
    concatenate_fields,
    read_field,
    read_ply,
    write_field,
)

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


@pytest.mark.parametrize("count, degree", [(7, 0), (7, 1), (7, 3), (0, 0)])
def test_a_field_comes_back_to_the_bit(tmp_path, count, degree):
    field = random_field(count, degree)
    for name in ("a.ply", "b.ply"):
        write_field(field, tmp_path / name)
    assert (tmp_path / "a.ply").read_bytes() == (tmp_path / "b.ply").read_bytes()
    back = read_field(tmp_path / "a.ply")
    assert back.sh_degree == degree
    for name in GaussianField.__dataclass_fields__:
        one, two = getattr(field, name), getattr(back, name)
        assert one.dtype == two.dtype and np.array_equal(one, two), name


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


ZERO = {(2, f"rot_{i}"): 0.0 for i in range(4)}


@pytest.mark.parametrize(
    "extra, change, said",
    [
        pytest.param([], {(2, "x"): np.nan}, "x of Gaussian 2 is not finite", id="a place"),
        pytest.param([], {(2, "f_dc_2"): -np.inf}, "f_dc_2 of Gaussian 2 is not finite", id="a colour"),
        pytest.param([], {(2, "rot_1"): np.inf}, "rot_1 of Gaussian 2 is not finite", id="a rotation"),
        pytest.param([], ZERO, "Gaussian 2 has a zero quaternion", id="no rotation"),
        pytest.param(["uncertainty"], {(2, "uncertainty"): -0.1}, "uncertainty of Gaussian 2 is -0.1", id="below 0"),
        pytest.param(["uncertainty"], {(2, "uncertainty"): 1.1}, "uncertainty of Gaussian 2 is 1.1", id="above 1"),
        pytest.param(["uncertainty"], {(2, "uncertainty"): np.nan}, "uncertainty of Gaussian 2 is not", id="neither"),
        pytest.param(["imagined"], {(2, "imagined"): 2}, "imagined of Gaussian 2 is neither", id="no flag"),
        pytest.param(["imagined"], {(2, "imagined"): np.nan}, "imagined of Gaussian 2 is neither", id="no number"),
    ],
)
def test_a_value_that_makes_no_sense_is_refused_with_its_index(tmp_path, extra, change, said):
    whole = {(row, name): 1.0 for row in range(2) for name in extra}
    with pytest.raises(InputError, match=f"a.ply: {said}"):
        read_field(foreign(tmp_path / "a.ply", extra=extra, change=whole | change))


def test_a_missing_file_or_property_is_named(tmp_path):
    with pytest.raises(InputError, match="a.ply: there is no such file"):
        read_field(tmp_path / "a.ply")
    for missing in ("x", "f_dc_1", "opacity", "scale_1", "rot_3"):
        with pytest.raises(InputError, match=rf"a.ply: property {missing} is missing"):
            read_field(foreign(tmp_path / "a.ply", drop=[missing]))


@pytest.mark.parametrize("count", [3, 8, 10, 12])
def test_harmonics_that_are_not_whole_are_refused(tmp_path, count):
    with pytest.raises(InputError, match=f"a.ply.*{count} f_rest"):
        read_field(foreign(tmp_path / "a.ply", extra=[f"f_rest_{i}" for i in range(count)]))


@pytest.mark.parametrize("text", [False, True], ids=["binary", "ascii"])
def test_a_file_cut_short_and_what_is_no_field_are_refused_by_name(tmp_path, text):
    path = foreign(tmp_path / "a.ply", rows=200, text=text)
    whole = path.read_bytes()
    no_field = (b"no ply at all", b"ply\n", b"ply\nformat ascii 1.0\nend_header\n")
    for content in (whole[: int(0.99 * len(whole))], whole[: int(0.02 * len(whole))], b"", *no_field):
        path.write_bytes(content)
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
    if len(line) < HEADER_BYTES:
        assert len(read_field(path)) == 3  # a comment that names the end of the header is read over
    path.write_bytes(path.read_bytes().replace(b"element vertex 3", b"element vertex 9999999999"))
    monkeypatch.setattr(PlyData, "read", lambda *_: pytest.fail("the vertices are allocated"))
    with pytest.raises(InputError, match="a.ply"):
        read_field(path)


def with_list(path, name):
    """A foreign field whose property of this name is a list of two numbers."""
    kinds = [(other, "O" if other == name else "<f4") for other in [*NAMES, "uncertainty", "ground", "imagined"]]
    table = np.ones(3, kinds)
    for row in table:
        row[name] = np.zeros(2, np.float32)
    PlyData([PlyElement.describe(table, "vertex", val_types={name: "f4"})]).write(str(path))
    return path


@pytest.mark.parametrize("name", ["x", "rot_3", "uncertainty", "ground", "imagined"])
def test_a_property_that_is_a_list_is_refused_by_name(tmp_path, name):
    with pytest.raises(InputError, match=rf"a.ply: property {name} is a list; export it again"):
        read_field(with_list(tmp_path / "a.ply", name))


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


def test_discs_of_two_deviations_and_flat_gaussians_get_a_thin_third_one(tmp_path):
    """2D Gaussian splatting has no scale_2; other files have the logarithm of zero."""
    two = read_field(foreign(tmp_path / "a.ply", drop=["scale_2"]))
    three = read_field(foreign(tmp_path / "b.ply", change={(k, "scale_2"): -np.inf for k in range(3)}))
    for field in (two, three):
        larger = field.log_scales[:, :2].max(1)
        assert field.log_scales[:, 2] == pytest.approx(larger + np.log(THIN), abs=1e-6)
    with pytest.raises(InputError, match="scale_0 of Gaussian 1"):
        read_field(foreign(tmp_path / "c.ply", change={(1, f"scale_{k}"): -np.inf for k in range(3)}))


def test_a_3d_filter_is_fused(tmp_path):
    """Deviations 3, 3, 3 and a filter of 4 give 5, 5, 5; opacity .5 becomes .5 (3/5)^3."""
    change = {(0, f"scale_{k}"): np.log(3) for k in range(3)} | {(0, "opacity"): 0.0, (0, "filter_3D"): 4.0}
    field = read_field(foreign(tmp_path / "a.ply", extra=["filter_3D"], rows=1, change=change))
    assert np.exp(field.log_scales[0]) == pytest.approx([5, 5, 5], rel=1e-6)
    assert 1 / (1 + np.exp(-field.opacity_logits[0])) == pytest.approx(0.5 * 0.6**3, rel=1e-5)
    change[0, "filter_3D"] = np.nan
    with pytest.raises(InputError, match="opacity of Gaussian 0"):
        read_field(foreign(tmp_path / "a.ply", extra=["filter_3D"], rows=1, change=change))


def test_an_infinite_opacity_is_the_most_opaque_one(tmp_path):
    field = read_field(foreign(tmp_path / "a.ply", change={(0, "opacity"): np.inf, (1, "opacity"): -np.inf}))
    assert field.opacity_logits[:2].tolist() == [16, -16] and field.opacity_logits[2] == 2 + 6 / 16


def with_doubles(path, rows, places):
    """A foreign field whose positions are doubles."""
    table = PlyData.read(str(foreign(path, rows=rows)))["vertex"].data
    wide = np.empty(rows, [(name, "<f8" if name in "xyz" else "<f4") for name in table.dtype.names])
    for name in table.dtype.names:
        wide[name] = places[:, "xyz".index(name)] if name in "xyz" else table[name]
    PlyData([PlyElement.describe(wide, "vertex")], byte_order="<").write(str(path))
    return path


def test_doubles_far_from_0_are_counted_from_an_origin(tmp_path):
    near = np.random.default_rng(0).uniform(-4, 4, (50, 3))
    far = near + [456789.25, 5234567.5, 420.0]
    splats = read_ply(with_doubles(tmp_path / "a.ply", 50, far))
    assert splats.field.means + splats.origin == pytest.approx(far, abs=1e-6)  # float32 of 4: 2.4e-7
    assert (splats.origin == np.round(splats.origin)).all() and np.abs(splats.field.means).max() < 10
    here = read_ply(with_doubles(tmp_path / "b.ply", 50, near))
    assert not here.origin.any() and here.field.means == pytest.approx(near, abs=1e-6)


BOUNDS = [f"{end}_{part}{axis}" for part in ("", "scale_") for end in ("min", "max") for axis in "xyz"]
BOUNDS += [f"{end}_{channel}" for end in ("min", "max") for channel in "rgb"]
WORDS = ("packed_position", "packed_rotation", "packed_scale", "packed_color")


def compressed(path, words, bounds, rows=1, kind="<u4"):
    """A compressed PLY all of whose Gaussians have the same words."""
    chunks, table = np.zeros(1, [(name, "<f4") for name in BOUNDS]), np.zeros(rows, [(name, kind) for name in WORDS])
    for name, value in bounds.items():
        chunks[name] = value
    for name, value in zip(WORDS, words, strict=True):
        table[name] = value
    PlyData([PlyElement.describe(chunks, "chunk"), PlyElement.describe(table, "vertex")]).write(str(path))
    return path


def test_a_compressed_field_is_unpacked(tmp_path):
    """x at its lower bound, y at its upper one, z at the middle; scales alike; w is the smaller half of a half turn."""
    place = 0 << 21 | 1023 << 11 | 1023
    bounds = {"min_x": -3, "max_x": 5, "min_y": 1, "max_y": 2, "min_z": 0, "max_z": 2047}
    bounds |= {"min_scale_x": -4, "max_scale_y": -1, "max_scale_z": 2047, "max_r": 1, "max_g": 0.5, "min_b": 0.25}
    words = (place, 1 << 30 | 512 << 20 | 512 << 10 | 512, place, 255 << 24 | 255 << 16 | 0 << 8 | 255)
    field = read_field(compressed(tmp_path / "a.ply", words, bounds))
    assert field.means[0] == pytest.approx([-3, 2, 1023], rel=1e-5)
    assert field.log_scales[0] == pytest.approx([-4, -1, 1023], rel=1e-5)
    assert field.quats[0] == pytest.approx([0, 1, 0, 0], abs=1e-3)  # the second of w, x, y, z is the largest
    assert field.base_colours[0] == pytest.approx([1, 0.5, 0.25], abs=1e-6)
    assert field.opacity_logits[0] == 16


def test_a_compressed_field_that_lacks_bounds_or_has_other_words_is_refused(tmp_path):
    with pytest.raises(InputError, match="a.ply: .*bounds of all"):
        read_field(compressed(tmp_path / "a.ply", (0, 0, 0, 0), {}, rows=257))
    with pytest.raises(InputError, match="b.ply: .*packed_position is missing or of another type"):
        read_field(compressed(tmp_path / "b.ply", (0, 0, 0, 0), {}, kind="<f4"))
    with pytest.raises(InputError, match="c.ply: x of Gaussian 0 is not finite"):
        read_field(compressed(tmp_path / "c.ply", (0, 0, 0, 0), {"min_x": np.nan}))
