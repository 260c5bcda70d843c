"""A plot of the prior: samples of held-out views."""

from pathlib import Path

import numpy as np
from jaxtyping import Float32
from numpy import ndarray as Array

from dav_gswt.images import figures
from dav_gswt.prior.terrain import TerrainPrior
from dav_gswt.views.uncertainty import w2_sq
from dav_gswt_study.prior.evaluation import Setting, opaque_mask
from dav_gswt_study.prior.training.example_files import Examples

GREY = 0.75  # background of pictures
SAMPLES = 3  # shown per view
INCH = 1.25  # side of a picture in a plot
HIGHEST = 0.98  # quantile of a map at which its colours end


def make_gallery(made: Examples, prior: TerrainPrior, setting: Setting) -> dict[str, Array]:
    """Columns of pictures (n s s 3) and maps (n h w) by title: condition, truth and samples.

    The error of the render is NaN where the truth is not opaque.
    """
    given, truth = made.condition, made.rgba
    asked = setting.steps, setting.seed
    noises = prior.decode(prior.sample(given, setting.m, 0.0, *asked, common=False)).rgba
    uncertainty = w2_sq(prior.sample(given, setting.m, setting.p_drop, *asked))[1]
    apart = np.sqrt(((given.colour - truth[..., :3]) ** 2).mean(-1))
    render = np.concatenate([given.colour, given.alpha[..., None]], -1)
    columns = {
        "photo given": given.photo,
        "render given": composite_over_grey(render),
        "truth": composite_over_grey(truth),
    }
    columns |= {f"sample {i + 1}": composite_over_grey(noises[:, i]) for i in range(min(SAMPLES, setting.m))}
    columns[f"mean of {setting.m}"] = composite_over_grey(noises.mean(1))
    return columns | {"error of render": np.where(opaque_mask(made), apart, np.nan), "uncertainty (w2_sq)": uncertainty}


def composite_over_grey(rgba: Float32[Array, "n s s 4"]) -> Float32[Array, "n s s 3"]:
    """Colours over black composited over GREY."""
    return np.clip(rgba[..., :3] + np.float32(GREY) * (1 - rgba[..., 3:]), 0, 1)


def plot_samples(columns: dict[str, Array], path: Path | str) -> None:
    """Plot a grid: one row per view, one column per picture or map, with the colour range of a map in its title."""
    count = len(next(iter(columns.values())))
    figure = figures.make_figure(INCH * len(columns), INCH * count + 0.5)
    grid = figure.subplots(count, len(columns), squeeze=False)
    for column, (title, values) in zip(grid.T, columns.items(), strict=True):
        how = {}
        if values.ndim == 3:
            how = {"vmin": 0, "vmax": float(np.nanquantile(values, HIGHEST)) or 1.0, "cmap": "magma"}
            title = f"{title}\n0 to {how['vmax']:.2g}"
        column[0].set_title(title, fontsize=9)
        for axes, value in zip(column, values, strict=True):
            axes.imshow(value, interpolation="nearest", **how)
            axes.set_axis_off()
    figures.save_figure(figure, path)
