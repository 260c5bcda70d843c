"""Networks of the terrain prior: an autoencoder of pictures, a denoiser of latents, an encoder of the condition.

Pictures are 64 x 64 with five channels (colour, opacity, inverse depth); latents are 8 x 16 x 16. The input of the
denoiser is the noisy latent, the latent of the field's render, its opacity, and a mask of the cells where the render is
valid. The nearest photo and the relative pose enter through cross-attention.
"""

from typing import Any

import torch
from diffusers.models.unets.unet_2d_condition import UNet2DConditionModel
from diffusers.schedulers.scheduling_ddim import DDIMScheduler
from jaxtyping import Float
from torch import Tensor, nn

SIZE = 64  # pixels per side
LATENT = (8, 16, 16)
CELL = SIZE // LATENT[1]  # pixels per side of a cell of a latent
PLANES = 5  # of a picture: red, green, blue, opacity, inverse depth
HIDDEN, BLOCKS = 96, 3  # channels and residual blocks of the encoder, and of the decoder
PATCH = 2  # cells per side of the photo's latent that make one token
WIDTH = 64  # of a token
TIMES = 1000  # steps of the diffusion in training


class Network(nn.Module):
    """All trained networks."""

    denoiser: nn.Module
    scale: Tensor

    def __init__(self):
        super().__init__()
        self.autoencoder = Autoencoder()
        self.denoiser = UNet2DConditionModel(
            sample_size=LATENT[1],
            in_channels=2 * LATENT[0] + 2,
            out_channels=LATENT[0],
            down_block_types=("DownBlock2D", "CrossAttnDownBlock2D", "CrossAttnDownBlock2D"),
            up_block_types=("CrossAttnUpBlock2D", "CrossAttnUpBlock2D", "UpBlock2D"),
            block_out_channels=(32, 64, 96),
            layers_per_block=1,
            cross_attention_dim=WIDTH,
            attention_head_dim=8,
            norm_num_groups=16,
        )
        self.condition_encoder = ConditionEncoder()
        self.register_buffer("scale", torch.ones(()))  # latents times it have unit variance

    def encode(self, planes: Float[Tensor, "n 5 s s"]) -> Float[Tensor, "n 8 h w"]:
        """Latents of pictures: the mode of the posterior, scaled."""
        means, _ = self.autoencoder.encoder(2 * planes - 1).chunk(2, 1)
        return means * self.scale

    def decode(self, latents: Float[Tensor, "n 8 h w"]) -> Float[Tensor, "n 5 s s"]:
        """Pictures of latents, in [0, 1]."""
        return ((self.autoencoder.decoder(latents / self.scale) + 1) / 2).clamp(0, 1)

    def predict_velocity(
        self,
        noisy: Float[Tensor, "n 8 h w"],
        time: Tensor,
        render: Float[Tensor, "n 8 h w"],
        known: Float[Tensor, "n 2 h w"],
        tokens: Float[Tensor, "n t width"],
    ) -> Float[Tensor, "n 8 h w"]:
        """The output of the denoiser. known: opacity of the render, and 1 in cells where the render is valid."""
        return self.denoiser(torch.cat([noisy, render, known], 1), time, tokens).sample


class Autoencoder(nn.Module):
    """A variational autoencoder that changes resolution once: cells of 4 x 4 pixels are folded into channels.

    encoder: means and log-variances of latents, of pictures in [-1, 1]; decoder: pictures, about in [-1, 1]. There is
    no normalisation, which would lose absolute colours.
    """

    def __init__(self):
        super().__init__()
        folded = PLANES * CELL * CELL
        self.encoder = nn.Sequential(
            nn.PixelUnshuffle(CELL),
            nn.Conv2d(folded, HIDDEN, 3, padding=1),
            *(Residual(HIDDEN) for _ in range(BLOCKS)),
            nn.Conv2d(HIDDEN, 2 * LATENT[0], 1),
        )
        self.decoder = nn.Sequential(
            nn.Conv2d(LATENT[0], HIDDEN, 3, padding=1),
            *(Residual(HIDDEN) for _ in range(BLOCKS)),
            nn.Conv2d(HIDDEN, folded, 3, padding=1),
            nn.PixelShuffle(CELL),
        )


class Residual(nn.Module):
    """x + f(x), with f = 0 before training."""

    def __init__(self, width: int):
        super().__init__()
        self.first, self.second = (nn.Conv2d(width, width, 3, padding=1) for _ in range(2))
        for parameter in self.second.parameters():
            nn.init.zeros_(parameter)

    def forward(self, x: Float[Tensor, "n c h w"]) -> Float[Tensor, "n c h w"]:
        silu = nn.functional.silu
        return x + self.second(silu(self.first(silu(x))))


class ConditionEncoder(nn.Module):
    """Tokens for the cross-attention: patches of the nearest photo's latent, and the relative pose."""

    def __init__(self):
        super().__init__()
        patches = LATENT[1] // PATCH
        self.photo = nn.Linear(LATENT[0] * PATCH * PATCH, WIDTH)
        self.place = nn.Parameter(0.02 * torch.randn(patches * patches, WIDTH))  # position embedding
        self.pose = nn.Sequential(nn.Linear(4, WIDTH), nn.SiLU(), nn.Linear(WIDTH, WIDTH))

    def forward(
        self, photo: Float[Tensor, "n 8 h w"], relative: Float[Tensor, "n 4"]
    ) -> Float[Tensor, "n tokens width"]:
        """The pose is added to every patch, since it decides where the patch lands in the view."""
        patches = nn.functional.unfold(photo, PATCH, stride=PATCH).transpose(1, 2)
        pose = self.pose(relative)[:, None]
        return torch.cat([self.photo(patches) + self.place + pose, pose], 1)


def make_schedule() -> Any:
    """Velocity prediction on a cosine schedule that ends in pure noise, sampled backwards from there.

    Returns: a DDIMScheduler. Any: its annotations reject the tensors that it takes.
    """
    return DDIMScheduler(
        num_train_timesteps=TIMES,
        beta_schedule="squaredcos_cap_v2",
        prediction_type="v_prediction",
        rescale_betas_zero_snr=True,
        timestep_spacing="trailing",
        clip_sample=False,
    )
