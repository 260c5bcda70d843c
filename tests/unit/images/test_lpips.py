"""LPIPS against a second implementation in NumPy and float64, and what a distance between pictures must hold."""

from itertools import combinations
from pathlib import Path

import numpy as np
import pytest
from numpy.lib.stride_tricks import sliding_window_view
from safetensors.numpy import load_file, save_file

from dav_gswt.errors import InputError
from dav_gswt.images import lpips, lpips_weights

FLOAT32 = 2e-4  # five float32 convolutions of up to 3456 terms each, differences of unit vectors squared


def pictures(*shape, seed=0):
    return np.random.default_rng(seed).uniform(-1, 1, (*shape, 3)).astype(np.float32)


def reference_layers(picture, weights):
    """AlexNet's features of one picture, in float64, by windows and sums; channels last."""
    x = (picture.astype(np.float64) - (-0.030, -0.088, -0.188)) / (0.458, 0.448, 0.450)
    out = []
    plan = [(4, 2, False), (1, 2, True), (1, 1, True), (1, 1, False), (1, 1, False)]  # stride, padding, pooled before
    for kernel, bias, (stride, padding, pooled) in zip(weights.kernels, weights.biases, plan, strict=True):
        if pooled:
            x = sliding_window_view(x, (3, 3), (0, 1))[::2, ::2].max((-1, -2))
        x = np.pad(x, ((padding, padding), (padding, padding), (0, 0)))
        windows = sliding_window_view(x, kernel.shape[2:], (0, 1))[::stride, ::stride]
        x = np.maximum(np.einsum("hwcij,ocij->hwo", windows, kernel.astype(np.float64), optimize=True) + bias, 0)
        out.append(x)
    return out


def reference(a, b, weights):
    """LPIPS of two pictures by its definition."""
    total = 0.0
    for x, y, head in zip(reference_layers(a, weights), reference_layers(b, weights), weights.heads, strict=True):
        x, y = (f / (np.sqrt((f**2).sum(-1, keepdims=True)) + 1e-10) for f in (x, y))
        total += (((x - y) ** 2) @ head.astype(np.float64)).mean()
    return total


@pytest.fixture(params=["random", "published"])
def weights(request):
    return request.getfixturevalue({"random": "random_weights", "published": "real_weights"}[request.param])


@pytest.mark.parametrize("shape", [(31, 31), (33, 47)], ids=str)
def test_lpips_in_float32_equals_the_reference_in_float64(weights, shape):
    a, b = pictures(2, *shape), pictures(2, *shape, seed=1)
    b[1] = (a[1] + 0.01 * b[1]).clip(-1, 1)  # nearly equal
    expected = [reference(x, y, weights) for x, y in zip(a, b, strict=True)]
    found = lpips.distance(a, b, weights)
    np.testing.assert_allclose(found, expected, rtol=FLOAT32)
    np.testing.assert_array_equal(lpips.distance(b, a, weights), found)


@pytest.mark.parametrize("m", [2, 5])
def test_the_mean_over_pairs_equals_the_pairs_one_by_one(random_weights, m):
    weights, sets = random_weights, pictures(3, m, 40, 44)
    sets[1] = (sets[1, :1] + 0.01 * sets[1]).clip(-1, 1)
    sets[2, 1:] = sets[2, :1]  # all equal but the last
    sets[2, -1] = pictures(40, 44, seed=9)
    pairs = [lpips.distance(sets[:, i], sets[:, j], weights) for i, j in combinations(range(m), 2)]
    np.testing.assert_allclose(lpips.pairwise_mean(sets, weights), np.mean(pairs, 0), rtol=FLOAT32)


def test_other_files_than_weights_of_this_network_are_refused(tmp_path):
    path, content = tmp_path / "own.safetensors", Path(lpips_weights.locate_weights("installed")).read_bytes()
    for other in (b"", content[:-1], b"0" * 999):
        path.write_bytes(other)
        with pytest.raises(InputError, match="own.safetensors: no weights of LPIPS"):
            lpips_weights.read(path)
    tensors = load_file(lpips_weights.locate_weights("installed"))
    for changed in ({"head3": tensors["head0"]}, {"bias1": tensors["bias1"].astype(np.float64)}):
        save_file(tensors | changed, path)
        with pytest.raises(InputError, match=f"{next(iter(changed))} is not of LPIPS"):
            lpips_weights.read(path)
    save_file({name: value for name, value in tensors.items() if name != "bias4"}, path)
    with pytest.raises(InputError, match="bias4"):
        lpips_weights.read(path)
    save_file(tensors | {"head2": np.full_like(tensors["head2"], np.nan)}, path)
    with pytest.raises(InputError, match="head2 holds numbers that are not finite"):
        lpips_weights.read(path)
