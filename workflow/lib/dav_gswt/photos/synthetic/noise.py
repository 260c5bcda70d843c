"""Random fields on a square that repeats: filtered white noise, and the wind ripples of sand.

Every field is an n x n raster over a square of side `period`. It is made from its spectrum, so it is smooth across the
edges of the square. Rows grow with y, columns with x.
"""

import numpy as np
import scipy.fft
from jaxtyping import Complex, Float
from numpy import ndarray as Array

from dav_gswt.threads import default_threads


def make_noise(
    rng: np.random.Generator, n: int, period: float, longest: float, shortest: float, slope: float
) -> Float[Array, "n n"]:
    """Isotropic noise of mean 0 and standard deviation 1 with wavelengths between `shortest` and `longest`.

    The amplitude of a wavelength w is proportional to w^slope: 0 is white, 2 a rolling terrain. Both limits are soft
    (Gaussian in the logarithm of the wavelength, an octave wide) to avoid ringing.
    """
    kx, ky = np.meshgrid(np.fft.rfftfreq(n, period / n), np.fft.fftfreq(n, period / n))
    k = np.hypot(kx, ky)
    k[0, 0] = 1.0
    length, most, least = -np.log2(k), np.log2(longest), np.log2(shortest)
    outside = np.maximum(length - most, 0) ** 2 + np.maximum(least - length, 0) ** 2
    gain = np.exp2(slope * np.minimum(length, most) - 4.0 * np.log2(np.e) * outside)
    gain[0, 0] = 0.0
    noise = scipy.fft.irfft2(gain * _white(rng, gain.shape), s=(n, n), workers=default_threads(), overwrite_x=True)
    return noise / noise.std()


def make_ripples(
    rng: np.random.Generator, n: int, period: float, length: float, wind: float
) -> tuple[Float[Array, "n n"], Float[Array, "n n"]]:
    """Wind ripples: their phase in radians, and their strength from 0 to 1.

    White noise is filtered by a narrow lobe of wave vectors around `wind` (the direction the wind blows to, radians
    from +x) with wave number 1 / length. The lobe is one-sided, so the noise is an analytic signal: the crests of its
    phase meander and fork like real ripples, and its modulus is 0 at the tip of a fork, where the phase is undefined.
    """
    frequencies = np.fft.fftfreq(n, period / n)
    white = _white(rng, (n, n))
    reached = np.flatnonzero(np.abs(frequencies) < 3 / length)  # beyond it the lobe is below exp(-60)
    kx, ky = np.meshgrid(frequencies[reached], frequencies[reached])
    along = length * (kx * np.cos(wind) + ky * np.sin(wind))
    across = length * (ky * np.cos(wind) - kx * np.sin(wind))
    lobe = np.exp(-0.5 * ((along - 1.0) / 0.11) ** 2 - 0.5 * (across / 0.17) ** 2)
    spectrum, some = np.zeros_like(white), np.ix_(reached, reached)
    spectrum[some] = lobe * white[some]
    signal = scipy.fft.ifft2(spectrum, workers=default_threads(), overwrite_x=True)
    modulus = np.abs(signal)
    return np.angle(signal), np.tanh(1.8 * modulus / (modulus.mean() + 1e-300))


def ripple_profile(phase: Float[Array, "..."]) -> Float[Array, "..."]:
    """Height over a ripple's phase, -1 to 1, mean near 0: a long windward slope, a short lee and narrow crests."""
    skewed = phase + 0.55 * np.sin(phase - 1.3)
    return (np.cos(skewed) + 0.22 * np.cos(2.0 * skewed)) / 1.22


def _white(rng: np.random.Generator, shape: tuple[int, int]) -> Complex[Array, "n m"]:
    """The spectrum of white noise: independent complex normal numbers."""
    out = np.empty(shape, complex)
    out.real, out.imag = rng.standard_normal(shape), rng.standard_normal(shape)
    return out


def texel_centres(n: int, period: float) -> tuple[Float[Array, "n n"], Float[Array, "n n"]]:
    """x and y of the centres of a raster's texels."""
    centres = (np.arange(n) + 0.5) * period / n
    x, y = np.meshgrid(centres, centres)
    return x, y


def sample_raster(
    raster: Float[Array, "n n"], period: float, x: Float[Array, "..."], y: Float[Array, "..."]
) -> Float[Array, "..."]:
    """Sample a repeating raster bilinearly. Texel (r, c) is at x = (c + .5) period/n, y likewise."""
    n = len(raster)
    u, v = np.asarray(x) * (n / period) - 0.5, np.asarray(y) * (n / period) - 0.5
    c, r = np.floor(u), np.floor(v)
    fu, fv = u - c, v - r
    c0, r0 = c.astype(np.int64) % n, r.astype(np.int64) % n
    c1, r1 = (c0 + 1) % n, (r0 + 1) % n
    low = raster[r0, c0] * (1 - fu) + raster[r0, c1] * fu
    high = raster[r1, c0] * (1 - fu) + raster[r1, c1] * fu
    return low * (1 - fv) + high * fv


def smoothstep(low: float, high: float, x: Array) -> Array:
    """0 below low, 1 above high, smooth between."""
    t = np.clip((x - low) / (high - low), 0, 1)
    return t * t * (3 - 2 * t)
