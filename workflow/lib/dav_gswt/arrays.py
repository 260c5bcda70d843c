"""What NumPy and PyTorch spell differently: a formula is written once, for arrays and for tensors on any device.

Of tensors no value is read and no shape depends on one: steps of a fit on a GPU never wait for the host. PyTorch and
SciPy take long to load: who needs neither does not wait for them.
"""

from typing import Any

import numpy as np
from numpy import ndarray as Array

TRUNCATE = 4.0  # standard deviations at which a Gaussian window ends, as SciPy's


def namespace(values: Any) -> Any:
    """The module whose functions take these values: numpy or torch."""
    if isinstance(values, np.ndarray):
        return np
    import torch

    return torch


def to_double(values: Any) -> Any:
    """As float64."""
    return values.astype(float) if isinstance(values, np.ndarray) else values.double()


def to_single(values: Any) -> Any:
    """As float32."""
    return values.astype(np.float32) if isinstance(values, np.ndarray) else values.float()


def on_host(values: Any) -> Array:
    """As an array: itself, or a tensor's values through memory that its device writes to by itself."""
    if isinstance(values, np.ndarray):
        return values
    there = namespace(values).empty(values.shape, dtype=values.dtype, pin_memory=values.is_cuda)
    return there.copy_(values.detach()).numpy()


def put_beside(array: Array, values: Any) -> Any:
    """An array where these values are: itself, or a tensor on their device."""
    return array if isinstance(values, np.ndarray) else namespace(values).as_tensor(array).to(values.device)


def count_up(n: int, values: Any) -> Any:
    """0 to n - 1 as float64, where these values are."""
    if isinstance(values, np.ndarray):
        return np.arange(n, dtype=float)
    torch = namespace(values)
    return torch.arange(n, dtype=torch.float64, device=values.device)


def zeros(shape: tuple[int, ...], values: Any) -> Any:
    """Zeros of the type of these values, and where they are."""
    return np.zeros(shape, values.dtype) if isinstance(values, np.ndarray) else values.new_zeros(shape)


def fill(values: Any, number: float | int) -> None:
    """Set all values to a number, in place."""
    values.fill(number) if isinstance(values, np.ndarray) else values.fill_(number)


def median(values: Any, mask: Any = None) -> Any:
    """Median over the first axis, of an even number the mean of the two in the middle. mask: which of a vector count;
    NaN if none does."""
    if isinstance(values, np.ndarray):
        values = values if mask is None else values[mask]
        return np.median(values, 0) if len(values) else np.float32(np.nan)
    torch = namespace(values)
    if mask is None:
        rising, n = values.sort(0).values, len(values)
        return (rising[(n - 1) // 2] + rising[n // 2]) / 2
    n = mask.sum().reshape(1)
    rising = torch.where(mask, values, torch.nan).sort().values  # NaN comes last
    low, high = ((n - 1) // 2).clamp(min=0), (n // 2).clamp(max=len(values) - 1)
    return (rising.gather(0, low) + rising.gather(0, high))[0] / 2


def measure_slopes(heights: Any, spacing: float) -> tuple[Any, Any]:
    """Rise of a height field to the east and to the north, by central differences."""
    if isinstance(heights, np.ndarray):
        north, east = np.gradient(heights, spacing)
    else:
        north, east = namespace(heights).gradient(heights, spacing=spacing)
    return east, north


def blur(values: Any, cells: float) -> Any:
    """Gaussian blur over a grid, of a standard deviation of so many cells; borders repeat."""
    if isinstance(values, np.ndarray):
        from scipy.ndimage import gaussian_filter

        return gaussian_filter(values, cells, mode="nearest")
    radius = int(TRUNCATE * cells + 0.5)
    taps = namespace(values).exp(-0.5 * ((count_up(2 * radius + 1, values) - radius) / cells) ** 2)
    return convolve(_pad(values, radius).double(), taps / taps.sum())[0, 0].to(values.dtype)


def average_around(values: Any, size: int) -> Any:
    """Mean over size x size cells (an odd number) around each of a grid; borders repeat."""
    if isinstance(values, np.ndarray):
        from scipy.ndimage import uniform_filter

        return uniform_filter(values, size, mode="nearest")
    return namespace(values).nn.functional.avg_pool2d(_pad(values, size // 2), size, 1)[0, 0]


def find_lowest_around(values: Any, size: int) -> Any:
    """Minimum over size x size cells (an odd number) around each of a grid; borders repeat."""
    if isinstance(values, np.ndarray):
        from scipy.ndimage import minimum_filter

        return minimum_filter(values, size, mode="nearest")
    return -namespace(values).nn.functional.max_pool2d(-_pad(values, size // 2), size, 1)[0, 0]


def convolve(planes: Any, taps: Any, padding: int = 0) -> Any:
    """Planes (a tensor 1 c h w) under a window that is taps^T taps, with so many zeros around them.

    As many groups as planes, plane after plane: so a GPU takes kernels of whole float32, not tensor cores, which round
    to 10 bits.
    """
    torch, c, planes = namespace(planes), planes.shape[1], planes.contiguous()
    column = taps.expand(c, 1, len(taps))
    planes = torch.nn.functional.conv2d(planes, column[..., None], padding=(padding, 0), groups=c)
    return torch.nn.functional.conv2d(planes, column[:, :, None], padding=(0, padding), groups=c)


def _pad(values: Any, width: int) -> Any:
    """A grid as planes 1 1 rows columns, its border repeated."""
    return namespace(values).nn.functional.pad(values[None, None], (width,) * 4, mode="replicate")
