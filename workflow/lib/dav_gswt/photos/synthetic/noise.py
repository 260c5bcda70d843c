"""Random fields on a square that repeats: filtered white noise, and the wind ripples of sand.

Every field lives on an n x n raster over a square of side `period` and is smooth across its edges, because it is made
from the spectrum. Rows grow with y, columns with x.
"""

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array


def make_noise(
    rng: np.random.Generator, n: int, period: float, longest: float, shortest: float, slope: float
) -> Float[Array, "n n"]:
    """Isotropic noise of mean 0 and standard deviation 1 with wavelengths between `shortest` and `longest`.

    The amplitude of a wavelength w is proportional to w^slope: 0 is white, 2 a rolling terrain. Both limits are soft
    (Gaussian in the logarithm of the wavelength, an octave wide), so that no ringing shows.

    Args:    longest, shortest: in the unit of `period`.
    Raises:  ValueError: no wave of the raster lies between the limits.
    """
    k = _wave_numbers(n, period, half=True)[2]
    k[0, 0] = 1.0
    length = 1.0 / k
    above = np.maximum(np.log2(length / longest), 0)
    below = np.maximum(np.log2(shortest / length), 0)
    gain = np.minimum(length, longest) ** slope * np.exp(-4.0 * (above**2 + below**2))
    gain[0, 0] = 0.0
    noise = np.fft.irfft2(gain * _white(rng, gain.shape), s=(n, n))
    spread = noise.std()
    if not spread > 0:
        raise ValueError(f"no wavelength between {shortest} and {longest} fits a raster of {n} over {period}")
    return noise / spread


def texel_centres(n: int, period: float) -> tuple[Float[Array, "n n"], Float[Array, "n n"]]:
    """x and y of the centres of a raster's texels."""
    centres = (np.arange(n) + 0.5) * period / n
    x, y = np.meshgrid(centres, centres)
    return x, y


def make_ripples(
    rng: np.random.Generator, n: int, period: float, length: float, wind: float
) -> tuple[Float[Array, "n n"], Float[Array, "n n"]]:
    """Wind ripples: their phase in radians and the strength, 0 to 1, with which they stand out.

    White noise is kept in a narrow lobe of wave vectors around `wind` (the direction the wind blows to, radians from
    +x) with wave number 1 / length. The lobe is one-sided, so the noise is an analytic signal: its angle is a phase
    whose crests meander and fork as those of real ripples do, and its modulus is 0 exactly where the phase is
    undefined, at a fork's tip.
    """
    kx, ky, _ = _wave_numbers(n, period)
    along = length * (kx * np.cos(wind) + ky * np.sin(wind))
    across = length * (ky * np.cos(wind) - kx * np.sin(wind))
    lobe = np.exp(-0.5 * ((along - 1.0) / 0.11) ** 2 - 0.5 * (across / 0.17) ** 2)
    signal = np.fft.ifft2(lobe * _white(rng, lobe.shape))
    modulus = np.abs(signal)
    return np.angle(signal), np.tanh(1.8 * modulus / (modulus.mean() + 1e-300))


def ripple_profile(phase: Float[Array, "..."]) -> Float[Array, "..."]:
    """Height over a ripple's phase, -1 to 1, mean near 0: a long windward slope, a short lee and narrow crests."""
    skewed = phase + 0.55 * np.sin(phase - 1.3)
    return (np.cos(skewed) + 0.22 * np.cos(2.0 * skewed)) / 1.22


def _white(rng: np.random.Generator, shape: tuple[int, int]) -> Array:
    """The spectrum of white noise: independent complex normal numbers."""
    return rng.standard_normal(shape) + 1j * rng.standard_normal(shape)


def _wave_numbers(n: int, period: float, half: bool = False) -> tuple[Array, Array, Array]:
    """Cycles per unit of length along x, along y, and in all; half: of a real field, whose other half follows."""
    kx = (np.fft.rfftfreq if half else np.fft.fftfreq)(n, period / n)
    kx, ky = np.meshgrid(kx, np.fft.fftfreq(n, period / n))
    return kx, ky, np.hypot(kx, ky)


def sample_raster(
    raster: Float[Array, "n n"], period: float, x: Float[Array, "..."], y: Float[Array, "..."]
) -> Float[Array, "..."]:
    """A repeating raster's value at places, bilinear. Texel (r, c) is at x = (c + .5) period/n, y likewise."""
    n = len(raster)
    u, v = np.asarray(x) * (n / period) - 0.5, np.asarray(y) * (n / period) - 0.5
    c, r = np.floor(u), np.floor(v)
    fu, fv = u - c, v - r
    c0, r0 = c.astype(np.int64) % n, r.astype(np.int64) % n
    c1, r1 = (c0 + 1) % n, (r0 + 1) % n
    low = raster[r0, c0] * (1 - fu) + raster[r0, c1] * fu
    high = raster[r1, c0] * (1 - fu) + raster[r1, c1] * fu
    return low * (1 - fv) + high * fv
