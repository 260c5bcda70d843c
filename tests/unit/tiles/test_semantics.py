"""What the ground is: features of segments; masks of SAM 2 from a folder.

The network here is tiny and learned nothing: published weights were never at hand.
"""

import shutil

import numpy as np
import pytest
import torch
from fixtures import lpips_arrays
from safetensors.torch import load_file, save_file

from dav_gswt.errors import InputError
from dav_gswt.tiles import sam2, semantics
from dav_gswt.tiles.semantics import SemanticSource, describe_segments, overlay_masks, segment_superpixels

WEIGHT = "no_memory_embedding"


@pytest.fixture(scope="module")
def weights():
    return lpips_arrays.random()


@pytest.fixture(scope="module")
def stones():
    """48 x 48 cells of noisy sand with three dark stones."""
    rng = np.random.default_rng(2)
    colour = 0.6 + 0.03 * rng.normal(size=(48, 48, 3))
    y, x = np.mgrid[:48, :48]
    for cy, cx in ((12, 12), (30, 34), (38, 10)):
        colour[(y - cy) ** 2 + (x - cx) ** 2 < 20] -= 0.4
    return np.clip(colour, 0, 1)


def at(*cells):
    return tuple(np.array(axis) for axis in zip(*cells, strict=True))


def test_stone_is_far_from_sand_and_near_to_other_stones(stones):
    found = describe_segments(segment_superpixels(stones, 6.0), stones, None)
    stone, other, sand, far = at((12, 12)), at((30, 34)), at((12, 30)), at((44, 44))
    assert found.distances(stone, sand)[0] > 5 * max(found.distances(stone, other)[0], found.distances(sand, far)[0])
    # a step where the stone begins, nothing within the sand
    assert found.slope[12, 14:20, 0].max() > 0 and found.slope[20:24, 20:24].max() == 0


@pytest.mark.parametrize("alexnet", [False, True])
def test_one_segment_alone_and_flat_ground_are_finite(weights, alexnet):
    flat = np.full((40, 40, 3), 0.5)
    for segments in (np.zeros((40, 40), int), segment_superpixels(flat, 8.0)):
        found = describe_segments(segments, flat, weights if alexnet else None)
        assert np.isfinite(found.distance).all() and np.isfinite(found.slope).all()
        assert found.unit.difference > 0 and found.unit.gradient > 0


def test_a_segment_has_the_features_of_the_place_where_it_lies(weights):
    """AlexNet sees texture that mean colours do not: a checkerboard of grey between flat fields of the same grey."""
    colour = np.full((48, 48, 3), 0.5)
    y, x = np.mgrid[:48, :48]
    colour[:, 32:] += 0.3 * np.where((y + x) % 4 < 2, 1, -1)[:, 32:, None]
    segments = np.kron(np.arange(36).reshape(6, 6), np.ones((8, 8), int))
    blind, seeing = (describe_segments(segments, colour, w) for w in (None, weights))
    flat, near, rough = at((12, 4)), at((28, 12)), at((28, 44))
    assert blind.distances(flat, rough)[0] < 1e-6
    assert seeing.distances(flat, rough)[0] > 3 * seeing.distances(flat, near)[0]


def test_the_same_bytes_on_any_number_of_threads(stones, weights):
    found, before = [], torch.get_num_threads()
    for threads in (1, 2):
        torch.set_num_threads(threads)
        found.append(semantics.make_semantic_layer(stones, SemanticSource(weights)))
        assert torch.get_num_threads() == threads
    torch.set_num_threads(before)
    np.testing.assert_array_equal(found[0].distance, found[1].distance)


def test_of_two_masks_over_one_another_the_smaller_lies_on_top():
    large, small = np.zeros((6, 6), bool), np.zeros((6, 6), bool)
    large[1:5, 1:5], small[2:4, 2:4] = True, True
    for masks in ([large, small], [small, large]):
        found = overlay_masks(np.zeros((6, 6), int), masks)
        assert len({found[0, 0], found[1, 1], found[2, 2]}) == 3 and (found[2:4, 2:4] == found[2, 2]).all()
    np.testing.assert_array_equal(overlay_masks(np.eye(6, dtype=int), []), np.eye(6))


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    transformers = pytest.importorskip("transformers", reason="needs transformers: pip install transformers==5.23.0")
    torch.manual_seed(3)
    backbone = transformers.Sam2HieraDetConfig(
        hidden_size=8,
        image_size=[64, 64],
        blocks_per_stage=[1, 1, 2, 1],
        embed_dim_per_stage=[8, 16, 32, 64],
        num_attention_heads_per_stage=[1, 1, 2, 2],
        window_size_per_stage=[4, 4, 4, 2],
        global_attention_blocks=[3],
    )
    vision = transformers.Sam2VisionConfig(
        backbone_config=backbone,
        backbone_channel_list=[64, 32, 16, 8],
        backbone_feature_sizes=[[16, 16], [8, 8], [4, 4]],
        fpn_hidden_size=32,
    )
    prompts = {"hidden_size": 32, "image_size": 64, "patch_size": 16, "mask_input_channels": 4}
    decoder = {"hidden_size": 32, "mlp_dim": 32, "num_attention_heads": 2, "iou_head_hidden_dim": 16}
    config = transformers.Sam2Config(
        vision_config=vision.to_dict(), prompt_encoder_config=prompts, mask_decoder_config=decoder
    )
    path = tmp_path_factory.mktemp("sam2") / "tiny"
    transformers.Sam2Model(config).save_pretrained(path)
    return path


@pytest.fixture
def copy(folder, tmp_path):
    return shutil.copytree(folder, tmp_path / "copy")


@pytest.fixture
def lenient(monkeypatch):
    """What learned nothing is sure of nothing: any answer counts, and a few points are enough."""
    monkeypatch.setattr(sam2, "MIN_PREDICTED_IOU", -np.inf)
    monkeypatch.setattr(sam2, "MIN_STABILITY", -np.inf)
    monkeypatch.setattr(sam2, "GRID_POINTS", 4)
    monkeypatch.setattr(sam2, "BATCH", 5)


@pytest.fixture
def picture():
    rng = np.random.default_rng(1)
    picture = np.full((40, 40, 3), 0.7)
    picture[10:20, 15:30] = [0.2, 0.3, 0.1]
    return np.clip(picture + 0.02 * rng.normal(size=picture.shape), 0, 1)


def test_masks_lie_on_the_exemplars_cells_and_are_not_alike(folder, picture, lenient):
    found = sam2.predict_masks(sam2.load_model(folder), picture)
    assert found and all(mask.shape == (40, 40) and mask.dtype == bool for mask in found)
    assert all(mask.sum() >= sam2.MIN_CELLS for mask in found)
    for i, one in enumerate(found):
        for other in found[:i]:
            assert (one & other).sum() / (one | other).sum() < sam2.MAX_IOU + 0.05  # compared on another grid


def test_with_masks_the_semantics_are_of_them_and_of_superpixels_between(folder, picture, lenient):
    first, again = (semantics.make_semantic_layer(picture, semantics.SemanticSource(sam2=folder)) for _ in range(2))
    plain = semantics.make_semantic_layer(picture, semantics.SemanticSource())
    assert (first.segments != plain.segments).any()
    np.testing.assert_array_equal(first.distance, again.distance)


def cut_short(path):
    path.write_bytes(path.read_bytes()[:1000])


def change_weights(change):
    def apply(path):
        values = load_file(path)
        change(values)
        save_file(values, path, {"format": "pt"})

    return apply


@pytest.mark.parametrize(
    "name, change, said",
    [
        ("", shutil.rmtree, "there is no such folder"),
        ("model.safetensors", lambda path: path.rename(path.parent / "weights.bin"), "weights.bin is a pickle"),
        ("config.json", lambda path: path.write_text('{"model_type": "clip"}'), "config.json: is not of SAM 2"),
        ("model.safetensors", cut_short, "cannot be read"),
        ("model.safetensors", change_weights(lambda values: values.pop(WEIGHT)), f"{WEIGHT} is missing"),
        ("model.safetensors", change_weights(lambda values: values[WEIGHT].fill_(np.nan)), f"{WEIGHT} has values that"),
    ],
    ids=["no folder", "a pickle", "another model", "cut short", "one weight missing", "not finite"],
)
def test_a_folder_that_is_not_right_is_named(copy, name, change, said):
    change(copy / name)
    with pytest.raises(InputError, match=said):
        sam2.load_model(copy)
