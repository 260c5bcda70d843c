"""How well a field shows what the test photos show. Test photos are seen by nothing but this."""

import numpy as np

from dav_gswt import metrics
from dav_gswt.field import Field
from dav_gswt.raster import render
from dav_gswt.views import View


def evaluate(field: Field, tests: list[View]) -> dict:
    """Mean PSNR (raw and colour-corrected) and SSIM over the test views, over the pixels that look at the ground.

    Returns: null where there is no test view, or where pictures are equal and PSNR has no value.
    """
    rows = []
    for view in tests:
        if not view.weight.any():
            continue
        seen = np.clip(render(field, view.camera).colour, 0, 1)
        level = np.clip(metrics.colour_corrected(seen, view.image, view.weight), 0, 1).astype(np.float32)
        rows.append(
            {
                "view": view.name,
                "psnr": metrics.psnr(seen, view.image, view.weight),
                "psnr_colour_corrected": metrics.psnr(level, view.image, view.weight),
                "ssim": metrics.ssim(seen, view.image, view.weight),
            }
        )
    means = {}
    for key in ("psnr", "psnr_colour_corrected", "ssim"):
        values = [row[key] for row in rows]
        means[key] = None if not values or None in values else float(np.mean(values))
    return means | {"test_views": rows}
