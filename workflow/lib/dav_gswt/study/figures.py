"""Matplotlib figures of the studies: create, save, arrange pictures."""

from pathlib import Path

from dav_gswt.files import atomic_file, copy_file
from dav_gswt.images import image_files

QUALITY = 88  # of JPEGs


def blank(width: float, height: float):
    """An empty figure, inches wide and high, 120 dots an inch."""
    from matplotlib.figure import Figure  # here, not above: it takes a second to load, and most jobs draw nothing

    return Figure(figsize=(width, height), dpi=120, layout="constrained")


def save(figure, path: Path | str) -> None:
    """A figure as a PNG, or as a JPEG by the path's ending: the same bytes each time."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    FigureCanvasAgg(figure)
    as_photo = Path(path).suffix == ".jpg"
    with atomic_file(path) as part:
        if as_photo:
            figure.savefig(part, format="jpg", pil_kwargs={"quality": QUALITY})
        else:
            figure.savefig(part, format="png", metadata={"Software": None})


def kept(source: Path | str, target: Path | str) -> None:
    """A picture for docs/: the same file, or as a JPEG, a fifth of the bytes where it shows photos, by the target's
    ending.
    """
    if Path(target).suffix != ".jpg":
        copy_file(source, target)
    else:
        from matplotlib.image import imsave

        with atomic_file(target) as part:
            imsave(part, image_files.read_photo(source), format="jpg", pil_kwargs={"quality": QUALITY})


def sheet(pictures: dict[str, list[Path | str]], heads: list[str], tall: float = 2.05):
    """Pictures of files beside each other, small: a row, so many inches tall, a name; each row's pictures under heads.

    As wide as the first row's pictures are for their height.
    """
    shown = {name: [image_files.read_photo(file) for file in files] for name, files in pictures.items()}
    wide = [float(picture.shape[1] / picture.shape[0]) for picture in next(iter(shown.values()))]
    figure = blank(tall * sum(wide), tall * len(shown))
    grid = figure.subplots(len(shown), len(heads), squeeze=False, width_ratios=wide)
    for (name, row), line in zip(shown.items(), grid, strict=True):
        for axes, picture, head in zip(line, row, heads, strict=True):
            axes.imshow(picture, interpolation="antialiased")
            axes.set_title(f"{name}: {head}" if axes is line[0] else head, fontsize=7, loc="left", pad=2)
            axes.axis("off")
    return figure


def fit_time(curves: dict[str, list[dict[str, float]]], path: Path | str) -> None:
    """PSNR of test photos (colour-corrected) against seconds of fitting, a line a scene."""
    figure = blank(6.4, 4.0)
    axes = figure.add_subplot()
    for scene, rows in curves.items():
        x, y = ([row[k] for row in rows] for k in ("seconds", "psnr_colour_corrected"))
        (line,) = axes.plot(x, y, label=scene)
        axes.annotate(
            f"{y[-1]:.1f} dB", (x[-1], y[-1]), xytext=(4, 0), textcoords="offset points", color=line.get_color()
        )
    axes.set_xlabel("seconds of fitting (looking at the photos included)")
    axes.set_ylabel("PSNR of test photos, colour-corrected (dB)")
    axes.set_xlim(left=0)
    axes.margins(x=0.12)
    axes.grid(alpha=0.3)
    axes.legend(frameon=False)
    save(figure, path)
