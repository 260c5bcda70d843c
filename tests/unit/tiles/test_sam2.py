"""SAM 2 from a folder. The network here is tiny and learned nothing: published weights were never at hand."""

import json
import shutil
import sys

import numpy as np
import pytest
import torch

from dav_gswt.errors import InputError
from dav_gswt.tiles import sam2, semantics

transformers = pytest.importorskip("transformers", reason="needs transformers: pip install transformers==5.23.0")


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    torch.manual_seed(3)
    config = transformers.Sam2Config(
        vision_config=transformers.Sam2VisionConfig(
            backbone_config=transformers.Sam2HieraDetConfig(
                hidden_size=8,
                image_size=[64, 64],
                blocks_per_stage=[1, 1, 2, 1],
                embed_dim_per_stage=[8, 16, 32, 64],
                num_attention_heads_per_stage=[1, 1, 2, 2],
                window_size_per_stage=[4, 4, 4, 2],
                global_attention_blocks=[3],
            ),
            backbone_channel_list=[64, 32, 16, 8],
            backbone_feature_sizes=[[16, 16], [8, 8], [4, 4]],
            fpn_hidden_size=32,
        ).to_dict(),
        prompt_encoder_config={"hidden_size": 32, "image_size": 64, "patch_size": 16, "mask_input_channels": 4},
        mask_decoder_config={
            "hidden_size": 32,
            "mlp_dim": 32,
            "num_attention_heads": 2,
            "iou_head_hidden_dim": 16,
        },
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


def test_what_learned_nothing_is_sure_of_nothing(folder, picture):
    assert sam2.predict_masks(sam2.load_model(folder), picture) == []


def test_with_masks_the_semantics_are_of_them_and_of_superpixels_between(folder, picture, lenient):
    first, again = (semantics.make_semantic_layer(picture, semantics.SemanticSource(sam2=folder)) for _ in range(2))
    plain = semantics.make_semantic_layer(picture, semantics.SemanticSource())
    assert first.description["segments"] == "sam2 and slic" and first.description["masks"] > 0
    assert (first.segments != plain.segments).any()
    np.testing.assert_array_equal(first.distance, again.distance)


def test_of_masks_alike_the_surest_stays():
    whole, part, other = np.ones((16, 16), bool), np.ones((16, 16), bool), np.zeros((16, 16), bool)
    part[0], other[:4] = False, True
    assert sam2.suppress_overlaps([part, other, whole], np.array([0.9, 0.8, 0.95])) == [2, 1]
    assert sam2.suppress_overlaps([part, whole], np.array([0.9, 0.9])) == [0]


def test_stability_is_the_overlap_at_two_thresholds():
    logits = torch.tensor([[[2.0, 2.0, 0.5, -2.0]], [[-2.0, -2.0, -2.0, -2.0]]])
    torch.testing.assert_close(sam2._stability(logits), torch.tensor([2 / 3, 0.0]))


def test_the_published_folders_for_videos_are_read_too(copy):
    config = json.loads((copy / "config.json").read_text())
    (copy / "config.json").write_text(json.dumps(config | {"model_type": "sam2_video"}))
    assert sam2.load_model(copy).config.prompt_encoder_config.image_size == 64


def cut_short(path):
    (path / "model.safetensors").write_bytes((path / "model.safetensors").read_bytes()[:1000])


def without(name):
    def change(path):
        from safetensors.torch import load_file, save_file

        values = load_file(path / "model.safetensors")
        del values[name]
        save_file(values, path / "model.safetensors", {"format": "pt"})

    return change


def not_finite(path):
    from safetensors.torch import load_file, save_file

    values = load_file(path / "model.safetensors")
    values["no_memory_embedding"][:] = np.nan
    save_file(values, path / "model.safetensors", {"format": "pt"})


def pickled(path):
    (path / "model.safetensors").rename(path / "pytorch_model.bin")


def of_another(path):
    (path / "config.json").write_text('{"model_type": "clip"}')


@pytest.mark.parametrize(
    "change, said",
    [
        pytest.param(shutil.rmtree, "there is no such folder", id="no folder"),
        pytest.param(pickled, "pytorch_model.bin is a pickle", id="a pickle"),
        pytest.param(of_another, "config.json: is not of SAM 2", id="another model"),
        pytest.param(lambda path: (path / "config.json").unlink(), "config.json", id="no config"),
        pytest.param(cut_short, "cannot be read", id="cut short"),
        pytest.param(without("no_memory_embedding"), "no_memory_embedding is missing", id="one weight missing"),
        pytest.param(not_finite, "no_memory_embedding has values that are not finite", id="not finite"),
    ],
)
def test_a_folder_that_is_not_right_is_named(copy, change, said):
    change(copy)
    with pytest.raises(InputError, match=said):
        sam2.load_model(copy)


def test_without_transformers_it_says_what_to_install(folder, monkeypatch):
    monkeypatch.setitem(sys.modules, "transformers", None)
    with pytest.raises(InputError, match="pip install 'transformers=="):
        sam2.load_model(folder)
