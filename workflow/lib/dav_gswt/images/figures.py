"""Matplotlib figures: create, save, arrange pictures; JPEGs for pages, and pages from Jinja2 templates."""

import io
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float
from jinja2 import Environment, StrictUndefined
from numpy import ndarray as Array

from dav_gswt.files import atomic_file
from dav_gswt.images import image_files

QUALITY = 88  # of JPEGs
KINDS = ((0.90, 0.62, 0.0), (0.0, 0.62, 0.45), (0.0, 0.45, 0.70), (0.80, 0.47, 0.65))  # of kinds of ground


def make_figure(width: float, height: float, **padding: Any):
    """An empty figure, inches wide and high, 120 dots an inch. padding: of matplotlib's ConstrainedLayoutEngine."""
    from matplotlib.figure import Figure  # here, not above: it takes a second to load, and most jobs draw nothing
    from matplotlib.layout_engine import ConstrainedLayoutEngine

    return Figure(figsize=(width, height), dpi=120, layout=ConstrainedLayoutEngine(**padding))


def save_figure(figure, path: Path | str) -> None:
    """A figure as a PNG, or as a JPEG by the path's ending: the same bytes each time."""
    options = {"pil_kwargs": {"quality": QUALITY}} if Path(path).suffix == ".jpg" else {"metadata": {"Software": None}}
    with atomic_file(path) as part:
        figure.savefig(part, **options)


def draw_sheet(pictures: dict[str, list[Path | str]], heads: list[str], tall: float = 2.05):
    """Pictures of files beside each other, small: a row, so many inches tall, a name; each row's pictures under heads.

    As wide as the first row's pictures are for their height.
    """
    shown = {name: [image_files.read_photo(file) for file in files] for name, files in pictures.items()}
    wide = [float(picture.shape[1] / picture.shape[0]) for picture in next(iter(shown.values()))]
    figure = make_figure(tall * sum(wide), tall * len(shown))
    grid = figure.subplots(len(shown), len(heads), squeeze=False, width_ratios=wide)
    for (name, row), line in zip(shown.items(), grid, strict=True):
        for axes, picture, head in zip(line, row, heads, strict=True):
            axes.imshow(picture, interpolation="antialiased")
            axes.set_title(f"{name}: {head}" if axes is line[0] else head, fontsize=7, loc="left", pad=2)
            axes.axis("off")
    return figure


def encode_jpeg(image: Float[Array, "h w 3"], quality: int) -> bytes:
    """A progressive JPEG of sRGB-encoded colours in [0, 1], the same bytes each time; quality: 1 to 95."""
    from matplotlib.image import imsave

    pixels, buffer = np.rint(np.clip(image, 0, 1) * 255).astype(np.uint8), io.BytesIO()
    options = {"quality": quality, "optimize": True, "progressive": True}
    imsave(buffer, np.ascontiguousarray(pixels), format="jpeg", pil_kwargs=options)
    return buffer.getvalue()


def render_template(template: Path | str, values: dict[str, Any]) -> str:
    """The template filled with values, which are escaped as HTML unless they are `markupsafe.Markup`."""
    environment = Environment(autoescape=True, undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True)
    return environment.from_string(Path(template).read_text(encoding="utf-8")).render(values) + "\n"
