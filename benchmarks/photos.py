"""How long photos take: structure from motion over 41 photos of dunes, and a view of each synthetic family.

Every figure goes to results/bench.json.
"""

import time
from pathlib import Path

import numpy as np
from record import report_figures

from dav_gswt.geometry import camera_layouts
from dav_gswt.photos.sfm.registration import SfmOptions, register_photos
from dav_gswt.photos.synthetic import scene as synthetic

COPR = Path("resources/photos/copr_dunes/images")
SIDE = 256  # pixels
VIEWS = 3  # of each family, from the side, where most is seen


def copr() -> dict[str, float]:
    """Quick structure from motion, from photos on disk to the undistorted model."""
    start = time.perf_counter()
    found = register_photos(COPR, SfmOptions(threads=2))
    seconds = time.perf_counter() - start
    print(f"copr_dunes: {len(found.model.names)} of 41 photos placed, focal length {found.focal.ratio:.3f} of EXIF's")
    return {"sfm_copr_seconds": seconds}


def views() -> dict[str, float]:
    """Seconds a view of each family, without the time to build the scene; the slowest is the figure."""
    out = {}
    for family in synthetic.FAMILIES:
        scene = synthetic.Scene(family, 0)
        places = camera_layouts.ring(VIEWS + 1, 45.0, synthetic.RADIUS)
        cameras = [camera_layouts.orbit(*p, (0.0, 0.0, 0.0), SIDE, SIDE, synthetic.FIELD_OF_VIEW) for p in places]
        synthetic.render(scene, cameras[0])  # builds the scene
        times = []
        for camera in cameras[1:]:
            start = time.perf_counter()
            synthetic.render(scene, camera)
            times.append(time.perf_counter() - start)
        out[f"synthetic_view_{family}_seconds"] = float(np.median(times))
    return out | {"synthetic_view_seconds": max(out.values())}


TARGETS = {"sfm_copr_seconds": 90, "synthetic_view_seconds": 2.5}  # the slowest family


def main() -> None:
    report_figures(copr() | views(), TARGETS)


if __name__ == "__main__":
    main()
