"""Random fields on a square that repeats: filtered white noise, and the wind ripples of sand.

Every field lives on an n x n raster over a square of side `period` and is smooth across its edges, because it is made
from the spectrum. Rows grow with y, columns with x.
"""

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import lru_cache

import numpy as np
import scipy.fft
from jaxtyping import Complex, Float
from numpy import ndarray as Array

from dav_gswt.threads import default_threads

ROWS = 128  # of a raster that a thread takes at a time


def make_noise(
    rng: np.random.Generator, n: int, period: float, longest: float, shortest: float, slope: float
) -> Float[Array, "n n"]:
    """Isotropic noise of mean 0 and standard deviation 1 with wavelengths between `shortest` and `longest`.

    The amplitude of a wavelength w is proportional to w^slope: 0 is white, 2 a rolling terrain. Both limits are soft
    (Gaussian in the logarithm of the wavelength, an octave wide), so that no ringing shows.

    Args:    longest, shortest: in the unit of `period`.
    Raises:  ValueError: no wave of the raster lies between the limits.
    """
    length = _log_wavelengths(n, period)
    most, least = np.log2(longest), np.log2(shortest)
    outside = np.maximum(length - most, 0) ** 2 + np.maximum(least - length, 0) ** 2
    gain = np.exp2(slope * np.minimum(length, most) - 4.0 * np.log2(np.e) * outside)
    gain[0, 0] = 0.0
    noise = scipy.fft.irfft2(gain * _white(rng, gain.shape), s=(n, n), workers=default_threads(), overwrite_x=True)
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
    modulus = map_rows(np.abs, signal)
    mean = modulus.mean() + 1e-300
    return map_rows(np.angle, signal), map_rows(lambda rows: np.tanh(1.8 * rows / mean), modulus)


def ripple_profile(phase: Float[Array, "..."]) -> Float[Array, "..."]:
    """Height over a ripple's phase, -1 to 1, mean near 0: a long windward slope, a short lee and narrow crests."""
    skewed = phase + 0.55 * np.sin(phase - 1.3)
    return (np.cos(skewed) + 0.22 * np.cos(2.0 * skewed)) / 1.22


def map_rows(function: Callable[..., Array], *rasters: Array) -> Array:
    """A function that takes each texel by itself, of bands of rows on several threads."""
    bands = [tuple(raster[i : i + ROWS] for raster in rasters) for i in range(0, len(rasters[0]), ROWS)]
    with ThreadPoolExecutor(default_threads()) as pool:
        return np.concatenate(list(pool.map(lambda band: function(*band), bands)))


def _white(rng: np.random.Generator, shape: tuple[int, int]) -> Complex[Array, "n m"]:
    """The spectrum of white noise: independent complex normal numbers."""
    out = np.empty(shape, complex)
    out.real, out.imag = rng.standard_normal(shape), rng.standard_normal(shape)
    return out


@lru_cache(maxsize=2)
def _log_wavelengths(n: int, period: float) -> Float[Array, "n m"]:
    """log2 of the wavelengths of a real field's spectrum; 0 for the constant."""
    kx, ky = np.meshgrid(np.fft.rfftfreq(n, period / n), np.fft.fftfreq(n, period / n))
    k = np.hypot(kx, ky)
    k[0, 0] = 1.0
    length = -np.log2(k)
    length.flags.writeable = False
    return length


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
