"""The networks of the project's own prior: a coder of pictures, a denoiser of codes, and what tells it of a view.

Pictures are 64 x 64 with five channels (colour, opacity, inverse depth); codes are 8 x 16 x 16. The denoiser sees the
noisy code, the code of the field's render, its opacity, and where anything is known at all; the nearest photo and the
relative pose reach it through attention.
"""

import torch
from diffusers import DDIMScheduler, UNet2DConditionModel
from diffusers.models.autoencoders.vae import DiagonalGaussianDistribution
from jaxtyping import Float
from torch import Tensor, nn

SIZE = 64  # pixels a side
CODE = (8, 16, 16)
PLANES = 5  # of a picture: red, green, blue, opacity, inverse depth
INNER, DEPTH = 96, 3  # channels and residual blocks of the coder, each way
SURE = -5.0  # log-variance of codes before training
PATCH = 2  # cells a side of the photo's code that make one token
WIDTH = 64  # of a token
TIMES = 1000


class Network(nn.Module):
    """Everything that is trained. The same shape serves the diffusion model and the regressor it is compared with."""

    def __init__(self):
        super().__init__()
        self.coder = Coder()
        self.denoiser = UNet2DConditionModel(
            sample_size=CODE[1],
            in_channels=2 * CODE[0] + 2,
            out_channels=CODE[0],
            down_block_types=("DownBlock2D", "CrossAttnDownBlock2D", "CrossAttnDownBlock2D"),
            up_block_types=("CrossAttnUpBlock2D", "CrossAttnUpBlock2D", "UpBlock2D"),
            block_out_channels=(32, 64, 96),
            layers_per_block=1,
            cross_attention_dim=WIDTH,
            attention_head_dim=8,
            norm_num_groups=16,
        )
        self.told = Told()
        self.register_buffer("scale", torch.ones(()))  # codes times it have unit variance

    def posterior(self, planes: Float[Tensor, "n 5 s s"]) -> DiagonalGaussianDistribution:
        """What the coder makes of pictures: a normal distribution of codes, not scaled."""
        return DiagonalGaussianDistribution(self.coder.encode(2 * planes - 1))

    def encoded(self, planes: Float[Tensor, "n 5 s s"]) -> Float[Tensor, "n 8 h w"]:
        """Codes of pictures, the mode of the coder's posterior, scaled."""
        return self.posterior(planes).mode() * self.scale

    def decoded(self, codes: Float[Tensor, "n 8 h w"]) -> Float[Tensor, "n 5 s s"]:
        """Pictures of codes, in [0, 1]."""
        return ((self.coder.decode(codes / self.scale) + 1) / 2).clamp(0, 1)

    def denoised(
        self,
        noisy: Float[Tensor, "n 8 h w"],
        time: Tensor,
        render: Float[Tensor, "n 8 h w"],
        known: Float[Tensor, "n 2 h w"],
        tokens: Float[Tensor, "n t width"],
    ) -> Float[Tensor, "n 8 h w"]:
        """The denoiser's prediction (velocity). known: opacity of the render, and 1 where it is to be believed."""
        return self.denoiser(torch.cat([noisy, render, known], 1), time, tokens).sample


class Coder(nn.Module):
    """A variational autoencoder whose only change of resolution is a fold: cells of 4 x 4 pixels become channels.

    Without normalisation, which would cost it the colours: a linear code of a cell (a principal component analysis) is
    within its reach from the first step, and better ones follow.
    """

    def __init__(self):
        super().__init__()
        cell = SIZE // CODE[1]
        folded = PLANES * cell * cell
        self.encoder = nn.Sequential(
            nn.PixelUnshuffle(cell),
            nn.Conv2d(folded, INNER, 3, padding=1),
            *(Residual(INNER) for _ in range(DEPTH)),
            nn.Conv2d(INNER, 2 * CODE[0], 1),
        )
        self.decoder = nn.Sequential(
            nn.Conv2d(CODE[0], INNER, 3, padding=1),
            *(Residual(INNER) for _ in range(DEPTH)),
            nn.Conv2d(INNER, folded, 3, padding=1),
            nn.PixelShuffle(cell),
        )
        with torch.no_grad():  # it begins nearly sure of its codes
            self.encoder[-1].weight[CODE[0] :] = 0
            self.encoder[-1].bias[CODE[0] :] = SURE

    def encode(self, pictures: Float[Tensor, "n 5 s s"]) -> Float[Tensor, "n 16 h w"]:
        """Means and log-variances of codes, of pictures in [-1, 1]."""
        return self.encoder(pictures)

    def decode(self, codes: Float[Tensor, "n 8 h w"]) -> Float[Tensor, "n 5 s s"]:
        """Pictures, about in [-1, 1]."""
        return self.decoder(codes)


class Residual(nn.Module):
    """x + f(x), f 0 at first."""

    def __init__(self, width: int):
        super().__init__()
        self.first, self.second = (nn.Conv2d(width, width, 3, padding=1) for _ in range(2))
        nn.init.zeros_(self.second.weight)
        nn.init.zeros_(self.second.bias)

    def forward(self, x: Float[Tensor, "n c h w"]) -> Float[Tensor, "n c h w"]:
        silu = nn.functional.silu
        return x + self.second(silu(self.first(silu(x))))


class Told(nn.Module):
    """Tokens for the denoiser's attention: patches of the nearest photo's code, and the relative pose."""

    def __init__(self):
        super().__init__()
        cells = CODE[1] // PATCH
        self.photo = nn.Linear(CODE[0] * PATCH * PATCH, WIDTH)
        self.place = nn.Parameter(0.02 * torch.randn(cells * cells, WIDTH))
        self.pose = nn.Sequential(nn.Linear(4, WIDTH), nn.SiLU(), nn.Linear(WIDTH, WIDTH))

    def forward(
        self, photo: Float[Tensor, "n 8 h w"], relative: Float[Tensor, "n 4"]
    ) -> Float[Tensor, "n tokens width"]:
        """Every patch knows the pose too: where it lands in the view depends on it."""
        patches = nn.functional.unfold(photo, PATCH, stride=PATCH).transpose(1, 2)
        pose = self.pose(relative)[:, None]
        return torch.cat([self.photo(patches) + self.place + pose, pose], 1)


def schedule() -> DDIMScheduler:
    """Velocity prediction on a cosine schedule that ends in pure noise, steps from there backwards."""
    return DDIMScheduler(
        num_train_timesteps=TIMES,
        beta_schedule="squaredcos_cap_v2",
        prediction_type="v_prediction",
        rescale_betas_zero_snr=True,
        timestep_spacing="trailing",
        clip_sample=False,
    )
