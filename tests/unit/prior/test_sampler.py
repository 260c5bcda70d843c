import numpy as np
import pytest
import torch
from diffusers import DDIMScheduler, UNet2DConditionModel

from dav_gswt.prior import sampler
from dav_gswt.prior.sampler import Sampling

SHAPE = (4, 8, 8)


@pytest.fixture(scope="module")
def network():
    torch.manual_seed(0)
    return UNet2DConditionModel(
        sample_size=8,
        in_channels=4,
        out_channels=4,
        down_block_types=("DownBlock2D", "CrossAttnDownBlock2D"),
        up_block_types=("CrossAttnUpBlock2D", "UpBlock2D"),
        block_out_channels=(16, 32),
        layers_per_block=1,
        cross_attention_dim=16,
        attention_head_dim=8,
        norm_num_groups=8,
    ).eval()


@pytest.fixture(scope="module")
def layers(network):
    return sampler.replace_dropout(network)


def drawn(network, layers, views=3, m=4, p=0.2, steps=3, seed=1, batch=8, common=True):
    """Latents of views that differ by their condition."""
    context = torch.randn((views, 5, 16), generator=torch.Generator().manual_seed(9))

    def denoise(latents, time, some):
        each = len(latents) // (some.stop - some.start)
        return network(latents, time, context[some].repeat_interleave(each, 0)).sample

    schedule = DDIMScheduler(num_train_timesteps=100, prediction_type="v_prediction")
    return sampler.sample_latents(denoise, layers, schedule, views, SHAPE, Sampling(m, p, steps, seed, batch, common))


def test_without_dropout_samples_are_equal_to_the_bit_and_with_it_they_differ_by_the_seed(network, layers):
    found = drawn(network, layers, p=0.0)
    assert found.shape == (3, 4, *SHAPE)
    assert all(np.array_equal(found[:, 0], found[:, i]) for i in range(4))
    found = drawn(network, layers)
    assert (found.var(axis=1).mean((1, 2, 3)) > 0).all() and not np.allclose(found[0], found[1])
    np.testing.assert_array_equal(drawn(network, layers), found)
    assert not np.allclose(drawn(network, layers, seed=2), found)


@pytest.mark.parametrize("p, common", [(0.2, True), (0.2, False)])
def test_a_view_does_not_depend_on_its_batch_nor_on_the_others(network, layers, p, common):
    one = drawn(network, layers, p=p, batch=4, common=common)
    for change in ({"batch": 64}, {"batch": 8}, {"views": 1}):
        found = drawn(network, layers, **({"p": p, "batch": 4, "common": common} | change))
        np.testing.assert_allclose(found, one[: len(found)], atol=1e-5)


def test_one_mask_holds_for_a_whole_trajectory(network, layers):
    seen = []
    hook = layers[0].register_forward_hook(lambda layer, *_: seen.append(layer.mask))
    drawn(network, layers, steps=4, views=1)
    hook.remove()
    assert len(seen) == 4 and all(mask is seen[0] for mask in seen)
    share = float((seen[0] == 0).float().mean())
    assert 0.1 < share < 0.3  # of 0.2
    assert layers[0].mask is None and layers[0].p == 0.0  # nothing is left for the next caller


@pytest.mark.parametrize("bad", [{"m": 0}, {"p": 1.0}, {"p": -0.1}, {"p": float("nan")}, {"steps": 0}])
def test_what_makes_no_sense_is_refused_by_name(network, layers, bad):
    with pytest.raises(ValueError, match="m is 0|p_drop is|steps is 0"):
        drawn(network, layers, **bad)


def test_latents_that_are_not_finite_are_refused_by_the_view(layers):
    def spoiled(latents, time, some):
        return latents * torch.tensor([1, torch.nan, 1])[: len(latents), None, None, None]

    with pytest.raises(ValueError, match="view 1"):
        sampler.sample_latents(spoiled, layers, DDIMScheduler(), 2, SHAPE, Sampling(1, 0.0, 2, 0))
