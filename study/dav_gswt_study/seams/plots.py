"""Figures of seams: comparison of variants, cuts in tiles, autocorrelations."""

from pathlib import Path

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array

from dav_gswt.geometry import cameras
from dav_gswt.images import figures
from dav_gswt.raster import render
from dav_gswt.tiles.build import TileSet
from dav_gswt_study.seams.repetition import Autocorrelations
from dav_gswt_study.seams.summary import EVERY, MEASURES

TILES_SHOWN = 4  # tiles of the figure of cuts
NAMES = {"seam_lpips": "Seam-LPIPS of cuts over their floor", "psnr": "PSNR of cuts (dB)", "jump": "jump across cuts"}


def write_ablation(path: Path | str, rows: list[dict], baseline: str) -> None:
    """A panel for each measure: every variant minus the baseline with its 95 % interval; dots are scenes."""
    variants = sorted({row["variant"] for row in rows})
    figure = figures.make_figure(11.0, 1.4 + 0.5 * max(len(variants), 1))
    for axes, measure in zip(figure.subplots(1, len(MEASURES)), MEASURES, strict=True):
        for place, variant in enumerate(variants):
            mine = [r for r in rows if (r["variant"], r["measure"]) == (variant, measure)]
            scenes = [r for r in mine if r["scene"] != EVERY]
            for row in [r for r in mine if r["scene"] == EVERY] or scenes[:1]:
                axes.plot([row["difference_low"], row["difference_high"]], [place, place], color="0.25", linewidth=2)
                axes.plot(row["difference"], place, "s", color="0.25", markersize=6)
            dots = [r["difference"] for r in scenes]
            axes.plot(dots, [place] * len(dots), "o", color="#0072b2", markersize=4, alpha=0.7)
        axes.axvline(0, color="black", linewidth=1, linestyle=":")
        axes.set_yticks(range(len(variants)), variants if axes.get_subplotspec().is_first_col() else [], fontsize=9)
        axes.set_ylim(len(variants) - 0.5, -0.5)
        axes.set_xlabel(f"{NAMES[measure]}, less that of {baseline}", fontsize=8)
        axes.tick_params(axis="x", labelsize=7)
        axes.grid(axis="x", alpha=0.3)
    figures.save_figure(figure, path)


def write_cuts(path: Path | str, variants: dict[str, TileSet]) -> None:
    """Some tiles from above with their cuts, a row for each variant."""
    figure = figures.make_figure(3.0 * TILES_SHOWN, 3.2 * len(variants))
    grid = figure.subplots(len(variants), TILES_SHOWN, squeeze=False)
    for line, (name, tiles) in zip(grid, variants.items(), strict=True):
        for axes, number in zip(line, np.linspace(0, 15, TILES_SHOWN).astype(int).tolist(), strict=True):
            axes.imshow(render_tile(tiles, number), extent=(0, tiles.side, 0, tiles.side))
            _draw_cuts(axes, tiles.labels[number], tiles.spacing)
            axes.set_title(f"{name}, tile {number}", fontsize=9, loc="left")
            axes.axis("off")
    figures.save_figure(figure, path)


def render_tile(tiles: TileSet, number: int) -> Float[Array, "h w 3"]:
    """A tile from above, two pixels a finest cell."""
    field, pixels = tiles.fields[0][number], 2 * len(tiles.labels[number])
    top = float(field.means[:, 2].max()) + 10 * tiles.spacing
    return np.clip(render(field, cameras.top_down(0.0, 0.0, pixels, pixels, 0.5 * tiles.spacing, top)).colour, 0, 1)


def _draw_cuts(axes, labels: Array, spacing: float) -> None:
    """Draw lines between cells of different labels."""
    from matplotlib.collections import LineCollection

    y, x = np.nonzero(labels[:, 1:] != labels[:, :-1])
    upright = np.stack([np.stack([x + 1, y], 1), np.stack([x + 1, y + 1], 1)], 1)
    y, x = np.nonzero(labels[1:] != labels[:-1])
    flat = np.stack([np.stack([x, y + 1], 1), np.stack([x + 1, y + 1], 1)], 1)
    lines = np.concatenate([upright, flat]) * spacing
    axes.add_collection(LineCollection(list(lines), colors="#d55e00", linewidths=1.0))


def write_autocorrelations(path: Path | str, measured: Autocorrelations) -> None:
    """Both autocorrelations over lags in tiles; dotted lines mark the tile's period."""
    figure, images = figures.make_figure(9.0, 4.4), []
    for axes, (name, r) in zip(
        figure.subplots(1, 2), (("terrain", measured.terrain), ("exemplar", measured.exemplar)), strict=True
    ):
        reach = 2.5 if name == "terrain" else 0.45 * len(measured.exemplar) / measured.pixels
        half = [n / 2 / measured.pixels for n in r.shape]
        extent = (-half[1], half[1], -half[0], half[0])
        images.append(axes.imshow(r, extent=extent, vmin=-0.2, vmax=0.2, cmap="RdBu_r", interpolation="none"))
        axes.set_xlim(-reach, reach)
        axes.set_ylim(-reach, reach)
        for lag in (-1, 1):
            axes.axvline(lag, color="0.4", linewidth=0.6, linestyle=":")
            axes.axhline(lag, color="0.4", linewidth=0.6, linestyle=":")
        axes.set_title(f"autocorrelation of the {name}", fontsize=10, loc="left")
        axes.set_xlabel("tiles east", fontsize=9)
    figure.colorbar(images[-1], ax=figure.axes, shrink=0.8)
    figures.save_figure(figure, path)
