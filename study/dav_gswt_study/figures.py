"""Colours of figures, and copies of them for pages."""

from pathlib import Path

from dav_gswt.files import atomic_file, copy_file
from dav_gswt.images import image_files
from dav_gswt.images.figures import QUALITY

OKABE_ITO = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9")  # for any colour vision


def copy_figure(source: Path | str, target: Path | str) -> None:
    """Copy a picture: the same file, or a JPEG by the target's ending, a fifth of the bytes where it shows photos."""
    if Path(target).suffix != ".jpg":
        copy_file(source, target)
    else:
        from matplotlib.image import imsave

        with atomic_file(target) as part:
            imsave(part, image_files.read_photo(source), format="jpg", pil_kwargs={"quality": QUALITY})
