"""The page of seams, a template filled with the tables that grow in study/docs/data; and figures of seams."""

from pathlib import Path

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array

from dav_gswt.geometry import cameras
from dav_gswt.images import figures
from dav_gswt.raster import render
from dav_gswt.tiles.build import TileSet
from dav_gswt_study import plots
from dav_gswt_study.markdown import format_table
from dav_gswt_study.seams.summary import EVERY, MEASURES

DIGITS = {"seam_lpips": 4, "psnr": 2, "jump": 2}
HEADS = {"seam_lpips": "Seam-LPIPS over its floor", "psnr": "PSNR (dB)", "jump": "jump"}
TILES_SHOWN = 4  # tiles of the figure of cuts
NAMES = {"seam_lpips": "Seam-LPIPS of cuts over their floor", "psnr": "PSNR of cuts (dB)", "jump": "jump across cuts"}


def describe_seams(summary: list[dict], ablation: list[dict], own: dict[str, str]) -> dict[str, str]:
    """Values of the page's template. summary, ablation: as `summary.read_seam_table` reads them.

    own: the tiling of each scene.
    """
    baseline = next((row["baseline"] for row in ablation), "")
    tables = {"scenes": _format_scenes(summary, own), "variants": _format_variants(ablation)}
    return {"baseline": baseline, "version": summary[0]["version"]} | tables


def _format_scenes(summary: list[dict], own: dict[str, str]) -> str:
    head = ["scene", "tiling", "sets"]
    head += [f"Seam-LPIPS over its floor: {place}" for place in ("borders", "cuts", "ceiling")]
    head += ["share", "jump at borders", "jump at cuts", "jump without a seam"]
    lines = []
    for row in summary:
        if (row["view"], row["ground"]) == (EVERY, EVERY) and own.get(row["scene"]) == row["variant"]:
            places = [format_interval(row, place, 4) for place in ("border", "cut", "ceiling")]
            way = f"{float(row['share']):.0%}" if row["share"] else ""
            jumps = [f"{float(row[f'{place}_jump']):.2f}" for place in ("border", "cut", "floor")]
            lines.append([row["scene"], f"`{row['variant']}`", row.get("sets") or "1", *places, way, *jumps])
    return format_table(head, lines)


def _format_variants(ablation: list[dict]) -> str:
    found = {(row["variant"], row["scene"], row["measure"]): row for row in ablation}
    cells = sorted({key[:2] for key in found}, key=lambda key: (key[0], key[1] != EVERY, key[1]))
    lines = []
    for variant, scene in cells:
        rows = [(measure, found.get((variant, scene, measure))) for measure in MEASURES]
        values = [format_interval(row, "difference", DIGITS[measure]) if row else "" for measure, row in rows]
        lines.append([f"`{variant}`", "all" if scene == EVERY else scene, *values])
    return format_table(["cut", "scene", *(HEADS[measure] for measure in MEASURES)], lines)


def format_interval(row: dict, name: str, digits: int) -> str:
    """A value and in brackets its interval; empty where it is not known."""
    if not row[name]:
        return ""
    value, low, high = (f"{float(row[key]):+.{digits}f}" for key in (name, f"{name}_low", f"{name}_high"))
    return f"{value} ({low}, {high})"


def write_ablation(path: Path | str, rows: list[dict], baseline: str) -> None:
    """A panel for each measure: every variant minus the baseline with its 95 % interval; dots are scenes."""
    variants = sorted({row["variant"] for row in rows})
    figure = figures.make_figure(11.0, 1.4 + 0.5 * max(len(variants), 1))
    for axes, measure in zip(figure.subplots(1, len(MEASURES)), MEASURES, strict=True):
        found, dots = [], []
        for variant in variants:
            mine = [r for r in rows if (r["variant"], r["measure"]) == (variant, measure)]
            scenes = [r for r in mine if r["scene"] != EVERY]
            shown = [r for r in mine if r["scene"] == EVERY] or scenes or [{}]  # without LPIPS there are none
            found.append(tuple(shown[0].get(key) for key in ("difference", "difference_low", "difference_high")))
            dots.append([r["difference"] for r in scenes])
        plots.draw_forest(axes, variants, found, dots)
        axes.tick_params(labelleft=axes.get_subplotspec().is_first_col())
        axes.set_xlabel(f"{NAMES[measure]}, minus {baseline}", fontsize=8)
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
