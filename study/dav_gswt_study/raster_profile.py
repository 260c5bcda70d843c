"""Where the rasterizer's time goes: stages of a forward and a backward pass, by instruction set and threads.

And how near blending comes to what the processor can do.
The picture is that of a field from above, as a fit sees it. A pair is a pixel and a splat that is blended into it; it
takes FLOPS_OF_A_PAIR, a fused multiply-add counted as two.
"""

from pathlib import Path

import numpy as np

from dav_gswt.field import GaussianField
from dav_gswt.geometry import camera_layouts
from dav_gswt.geometry.scene_frame import SceneFrame
from dav_gswt.images import figures
from dav_gswt.photos.synthetic.scene import FIELD_OF_VIEW
from dav_gswt.raster import _core, cpu, to_raster_arrays
from dav_gswt_study import markdown

# alpha and transmittance: offset 2, quadratic form 8, power of two 13, weight and rest 2; both passes need them.
# forward: three channels and depth, 8. backward: share and remainder 7, v 8, moments 11, three channels 6.
FLOPS_OF_A_PAIR = (25 + 8) + (25 + 7 + 8 + 11 + 6)
REPEATS = 15
PEAK_SECONDS = 0.5
BLENDING = "find blocks", "blend", "blend backward", "collect"


def profile_rasterizer(
    field: GaussianField, frame: SceneFrame, size: int, threads: tuple[int, ...] = (1, 2)
) -> list[dict]:
    """A row for each instruction set and number of threads: the shortest pass of some, by stage.

    size: pixels a side of the picture.
    """
    square = frame.exemplar
    middle = (square.west + square.side / 2, square.south + square.side / 2, 0.0)
    camera = camera_layouts.orbit(60.0, 0.0, frame.flying_height, middle, size, size, FIELD_OF_VIEW)
    arrays = to_raster_arrays(field)
    gradient = np.random.default_rng(0).normal(size=(size, size, 3)).astype(np.float32)
    rows = []
    for name in cpu.instruction_sets():
        for count in threads:
            drawn = cpu.Rasterizer(threads=count, instruction_set=name)
            found = []
            for _ in range(REPEATS):
                drawn.forward(**arrays, camera=camera)
                drawn.backward(gradient)
                found.append(drawn.stage_seconds)
            best = min(found, key=lambda seconds: sum(seconds.values()))
            peak, pairs = _core.peak(name, PEAK_SECONDS, count), drawn.count_pairs()
            floor = pairs * FLOPS_OF_A_PAIR / (2 * peak)
            total, blending = sum(best.values()), sum(best[stage] for stage in BLENDING)
            facts = {"gaussians": len(field), "pixels": size * size, "pairs": pairs, "peak_gfma": peak / 1e9}
            shares = {"share": floor / total, "share_blending": floor / blending}
            milliseconds = {f"{stage}_ms".replace(" ", "_"): 1e3 * spent for stage, spent in best.items()}
            rows.append({"instructions": name, "threads": count} | facts | shares | milliseconds)
    return rows


def stage_columns(rows: list[dict]) -> list[str]:
    """The columns of milliseconds, in the order of the stages."""
    return [column for column in rows[0] if column.endswith("_ms")]


def describe_profile(rows: list[dict]) -> dict[str, str]:
    """The tables of the page study/report/rasterizer.md."""
    head = ["instructions", "threads", "ms", "pairs, G/s", "multiply-adds at most, G/s", "share", "of blending"]
    body = []
    for row in rows:
        total = sum(row[column] for column in stage_columns(rows))
        rate = row["pairs"] / total / 1e6
        cells = [f"{total:.1f}", f"{rate:.2f}", f"{row['peak_gfma']:.0f}"]
        body.append([row["instructions"], f"{row['threads']:.0f}", *cells])
        body[-1] += [f"{row['share']:.3f}", f"{row['share_blending']:.3f}"]
    names = [column.removesuffix("_ms").replace("_", " ") for column in stage_columns(rows)]
    stages = [
        [row["instructions"], f"{row['threads']:.0f}", *(f"{row[column]:.1f}" for column in stage_columns(rows))]
        for row in rows
    ]
    return {
        "rates": markdown.format_table(head, body),
        "stages": markdown.format_table(["instructions", "threads", *names], stages),
        "gaussians": f"{rows[0]['gaussians']:,.0f}",
        "side": f"{rows[0]['pixels'] ** 0.5:.0f}",
        "flops": str(FLOPS_OF_A_PAIR),
        "pairs": f"{rows[0]['pairs'] / rows[0]['pixels']:.0f}",
    }


def plot_stages(rows: list[dict], path: Path | str) -> None:
    """A bar a row: milliseconds of the stages, one after the other."""
    figure = figures.make_figure(9.0, 0.6 + 0.45 * len(rows))
    axes, left = figure.add_subplot(), np.zeros(len(rows))
    labels = [f"{row['instructions']}, {row['threads']:.0f}" for row in rows]
    for number, column in enumerate(stage_columns(rows)):
        spent = np.array([row[column] for row in rows])
        again, hue = divmod(number, len(figures.OKABE_ITO))
        name, colour = column.removesuffix("_ms").replace("_", " "), figures.OKABE_ITO[hue]
        axes.barh(labels, spent, left=left, label=name, edgecolor="white", hatch="///" * again, color=colour)
        left += spent
    axes.set_xlabel("milliseconds of a forward and a backward pass (instruction set, threads)")
    axes.invert_yaxis()
    axes.legend(fontsize=7, ncols=3, frameon=False)
    figures.save_figure(figure, path)
