"""Zero-1-to-3 with weights that learned nothing, tiny, in the layouts that the real ones are published in."""

import json
import shutil
import socket
import sys

import kornia
import numpy as np
import pytest
import torch
from diffusers import AutoencoderKL, UNet2DConditionModel
from safetensors.torch import load_file, save_file

from dav_gswt.errors import InputError
from dav_gswt.prior import zero123
from dav_gswt.prior.interface import Condition, Prior
from dav_gswt.prior.zero123 import LATENT, SIZE, Zero123

transformers = pytest.importorskip("transformers", reason="needs transformers: pip install transformers==5.23.0")

WIDTH = 16
UNET, CODER, EYE = ("diffusion_pytorch_model.safetensors",) * 2 + ("model.safetensors",)
NEWER = {"to_q": "query", "to_k": "key", "to_v": "value", "to_out.0": "proj_attn"}


def networks():
    torch.manual_seed(7)
    unet = UNet2DConditionModel(
        sample_size=32,
        in_channels=8,
        out_channels=4,
        down_block_types=("DownBlock2D", "CrossAttnDownBlock2D"),
        up_block_types=("CrossAttnUpBlock2D", "UpBlock2D"),
        block_out_channels=(16, 32),
        layers_per_block=1,
        cross_attention_dim=WIDTH,
        attention_head_dim=8,
        norm_num_groups=8,
    )
    coder = AutoencoderKL(
        down_block_types=("DownEncoderBlock2D",) * 4,
        up_block_types=("UpDecoderBlock2D",) * 4,
        block_out_channels=(4, 4, 8, 8),
        norm_num_groups=4,
        sample_size=SIZE,
    )
    eye = transformers.CLIPVisionConfig(
        hidden_size=16,
        intermediate_size=32,
        num_hidden_layers=1,
        num_attention_heads=2,
        image_size=28,
        patch_size=14,
        projection_dim=WIDTH,
    )
    return unet, coder, transformers.CLIPVisionModelWithProjection(eye), torch.nn.Linear(WIDTH + 4, WIDTH)


def written(folder, place):
    """A folder as diffusers writes it, with the pose's layer in `place`."""
    unet, coder, eye, projection = networks()
    for part, name in ((unet, "unet"), (coder, "vae"), (eye, "image_encoder")):
        part.save_pretrained(folder / name)
    (folder / place).mkdir()
    prefix = zero123.PROJECTIONS[place]
    save_file({prefix + name: v for name, v in projection.state_dict().items()}, folder / place / UNET)
    return folder


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """The first layout, with the names that older versions gave to the coder's attention and to CLIP's constant."""
    path = written(tmp_path_factory.mktemp("one") / "zero123-xl", "cc_projection")
    changed(path / "vae" / CODER, older)
    changed(path / "image_encoder" / EYE, lambda v: v | {"vision_model.embeddings.position_ids": torch.arange(5)[None]})
    return path


@pytest.fixture(scope="module")
def prior(folder):
    return Zero123.open(folder)


def changed(path, change):
    values = change({name: v.clone() for name, v in load_file(path).items()})
    save_file(values, path)


def older(values):
    for now, before in NEWER.items():
        values = {n.replace(f".{now}.", f".{before}.") if "attentions" in n else n: v for n, v in values.items()}
    assert any("proj_attn" in name for name in values)
    return values


def condition(count=2, seed=0):
    rng, pixels = np.random.default_rng(seed), (count, SIZE, SIZE)
    shapes = (*pixels, 3), pixels, pixels, (*pixels, 3), (count, 4)
    return Condition(*(rng.uniform(0, 1, shape).astype(np.float32) for shape in shapes))


def test_it_is_a_prior_of_the_published_sizes(prior):
    found = prior.sample(condition(), 3, 0.2, 2, 0)
    assert isinstance(prior, Prior) and (prior.name, prior.size) == ("zero123", 256)
    assert found.shape == (2, 3, 4, 32, 32) and found.dtype == np.float32
    made = prior.decode(found[:1])
    assert made.shape == (1, 3, 256, 256, 4) and made.min() >= 0 and made.max() <= 1


def test_both_layouts_hold_the_same_prior(prior, tmp_path):
    other = written(tmp_path / "other", "clip_camera_projection")
    for path in other.rglob("*.safetensors"):  # in half precision, under that variant's name
        changed(path, lambda values: {name: v.half() for name, v in values.items()})
        path.rename(path.with_suffix(".fp16.safetensors"))
    found = Zero123.open(other).sample(condition(), 1, 0.0, 2, 0)
    np.testing.assert_allclose(found, prior.sample(condition(), 1, 0.0, 2, 0), atol=0.05)  # halves have 3 digits


def test_it_samples_as_the_authors_write_it_down(prior):
    """The plain twin: their preparation by kornia, their loop over DDIM's formula, no sampler of ours."""
    view, steps, parts = condition(1), 3, prior.networks
    photo = 2 * torch.from_numpy(view.photo.transpose(0, 3, 1, 2).copy()) - 1
    seen = kornia.geometry.resize(photo, (28, 28), interpolation="bicubic", align_corners=True, antialias=False)
    mean, spread = torch.tensor([0.48145466, 0.4578275, 0.40821073]), torch.tensor([0.26862954, 0.26130258, 0.27577711])
    seen = kornia.enhance.normalize((seen + 1) / 2, mean, spread)
    elevation, sine, cosine, radius = view.relative[0].tolist()
    pose = torch.tensor([[-elevation, sine, cosine, 1.85 * radius]])
    left = torch.linspace(0.00085**0.5, 0.012**0.5, 1000).square().neg().add(1).cumprod(0)
    with torch.inference_mode():
        token = parts.projection(torch.cat([parts.image_encoder(seen).image_embeds, pose], 1))[:, None]
        latent = parts.vae.encode(photo).latent_dist.mode()
        x = torch.randn(LATENT, generator=torch.Generator().manual_seed(5))[None]
        times = [1 + i * (1000 // steps) for i in range(steps)]
        for i in reversed(range(steps)):
            t = torch.tensor(times[i])
            alone = parts.unet(torch.cat([x, 0 * latent], 1), t, 0 * token).sample
            noise = alone + 3.0 * (parts.unet(torch.cat([x, latent], 1), t, token).sample - alone)
            now, then = left[times[i]], left[times[i - 1]] if i else left[0]
            x = then.sqrt() * (x - (1 - now).sqrt() * noise) / now.sqrt() + (1 - then).sqrt() * noise
    np.testing.assert_allclose(prior.sample(view, 1, 0.0, steps, 5)[:, 0], x, rtol=1e-4, atol=1e-4)
    assert np.abs(Zero123(prior.networks, 1.0).sample(view, 1, 0.0, steps, 5)[:, 0] - x.numpy()).max() > 1e-3


def test_nothing_is_ever_fetched(folder, monkeypatch):
    def refused(*_, **__):
        raise AssertionError("a connection was tried")

    monkeypatch.setattr(socket.socket, "connect", refused)
    monkeypatch.setattr(socket, "getaddrinfo", refused)
    Zero123.open(folder)
    with pytest.raises(InputError, match="never fetched"):
        Zero123.open("bennyguo/zero123-xl-diffusers")


def pickle_instead(path):
    torch.save(load_file(path), path.with_name("pytorch_model.bin"))
    path.unlink()


def put(**tensors):
    return lambda path: changed(path, lambda values: values | {n.replace("__", "."): v for n, v in tensors.items()})


@pytest.mark.parametrize(
    "part, damage, message",
    [
        ("unet", lambda path: path.write_bytes(path.read_bytes()[:-100]), f"{UNET}: not readable as safetensors"),
        ("vae", lambda path: torch.save(load_file(path), path), f"{CODER}: not readable as safetensors"),
        ("image_encoder", pickle_instead, "pytorch_model.bin: a pickle.*docs/prior.md"),
        ("unet", lambda path: path.unlink(), f"there is no {UNET}"),
        ("cc_projection", put(projection__weight=torch.zeros(3, 3)), r"the shape \(3, 3\), not \(16, 20\)"),
        ("unet", put(conv_in__bias=torch.zeros(16, dtype=torch.int32)), "conv_in.bias has the type I32"),
    ],
)
def test_damaged_weights_are_refused_by_name(folder, tmp_path, part, damage, message):
    copied = shutil.copytree(folder, tmp_path / "copy")
    damage(next((copied / part).glob("*.safetensors")))
    with pytest.raises(InputError, match=message):
        Zero123.open(copied)


@pytest.mark.parametrize(
    "name, change, message",
    [
        ("unet/config.json", {"in_channels": 4}, "has the shape"),
        ("vae/config.json", {"latent_channels": 16}, "has the shape"),
        ("image_encoder/config.json", {"projection_dim": 8}, "has the shape"),
        ("vae/config.json", {"down_block_types": ["Another"]}, "describes no such network"),
        ("unet/config.json", None, "describes no such network"),  # a text, which diffusers would try to fetch
    ],
)
def test_a_config_of_another_model_is_refused_by_name(folder, tmp_path, name, change, message):
    path = shutil.copytree(folder, tmp_path / "copy") / name
    path.write_text(json.dumps(json.loads(path.read_text()) | change if change else "owner/model"))
    with pytest.raises(InputError, match=message):
        Zero123.open(tmp_path / "copy")


def test_a_folder_of_something_else_or_of_too_many_bytes_is_refused_by_what_it_is(folder, tmp_path, monkeypatch):
    with pytest.raises(InputError, match="is not Zero-1-to-3"):
        Zero123.open(tmp_path)
    with monkeypatch.context() as patch, pytest.raises(InputError, match="pip install 'transformers=="):
        patch.setitem(sys.modules, "transformers", None)
        Zero123.open(folder)
    monkeypatch.setattr(zero123, "MOST_BYTES", 1000)
    with pytest.raises(InputError, match="GiB of weights"):
        Zero123.open(folder)
